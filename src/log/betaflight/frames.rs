//! The frames of one flight, from its bytes: which are whole, which are to be believed, and what they hold.

use super::bits::{BrokenOff, Cursor};
use super::header::{FlightHeader, FrameFields, Predictor, read_group};
use crate::cancel;
use crate::log::thresholds::THRESHOLDS;

/// Longer ones are none: firmwares keep them below.
const LONGEST_FRAME: usize = 256;
/// Letters that frames begin with.
const LETTERS: &[u8] = b"IPGHSE";

/// What is done with the frames.
pub(super) trait FrameSink {
    /// A main frame: its time since the first start of the clock, and its numbers.
    fn main(&mut self, microseconds: i64, numbers: &[i32]) -> Result<(), String>;
    /// A frame of what changes rarely.
    fn slow(&mut self, numbers: &[i32]) -> Result<(), String>;
    /// A position: its time, where it has one of its own, and its numbers; not-a-number where they need home and there is none.
    fn gps(&mut self, microseconds: Option<i64>, numbers: &[Option<i32>]) -> Result<(), String>;
    /// Bytes that were left out, by the code of the reason.
    fn skip(&mut self, code: &'static str, subject: &str, at: usize);
}

/// Where the control loop was: its turn, and its clock of 32 bits.
#[derive(Debug, Clone, Copy)]
struct Stamp {
    turn: u32,
    microseconds: u32,
}

impl Stamp {
    /// Whether `next` may come next.
    fn leads_to(self, next: Self) -> bool {
        next.turn.wrapping_sub(self.turn) < THRESHOLDS.blackbox_turns
            && next.microseconds.wrapping_sub(self.microseconds) < THRESHOLDS.blackbox_pause
    }
}

/// Reads the frames of one flight.
pub(super) struct FrameReader<'a> {
    header: &'a FlightHeader,
    bytes: &'a [u8],
    /// The frame being read, the last good one and the one before it.
    current: Vec<i32>,
    previous: Vec<i32>,
    before: Vec<i32>,
    /// Whether differences to the last frame mean anything.
    follows: bool,
    last: Option<Stamp>,
    /// A stamp that does not follow from the last one: the next frame tells which of the two was wrong.
    doubted: Option<Stamp>,
    /// [µs] the time of `last` without the overflows of its clock.
    microseconds: i64,
    home: Option<Vec<i32>>,
}

/// What an event says of the frames behind it.
enum Event {
    Other,
    End,
    Resume(Stamp),
}

impl<'a> FrameReader<'a> {
    /// `bytes` are those of the flight, its header included.
    pub(super) fn new(header: &'a FlightHeader, bytes: &'a [u8]) -> Self {
        let numbers = vec![0; header.intra.names.len()];
        Self {
            header,
            bytes,
            current: numbers.clone(),
            previous: numbers.clone(),
            before: numbers,
            follows: false,
            last: None,
            doubted: None,
            microseconds: 0,
            home: None,
        }
    }

    /// Reads all frames; the error says why it ends early.
    pub(super) fn read(mut self, sink: &mut dyn FrameSink) -> Result<(), String> {
        let mut at = self.header.length;
        let mut count = 0_u32;
        while let Some(letter) = self.bytes.get(at).copied() {
            count = count.wrapping_add(1);
            if count.is_multiple_of(4_096) {
                cancel::check();
            }
            let mut cursor = Cursor::new(self.bytes, at + 1);
            match self.take(letter, &mut cursor, at, sink)? {
                Some(Event::End) => return Ok(()),
                Some(_) => at = cursor.at,
                None => {
                    self.follows = false;
                    sink.skip("damaged_bytes", "", at);
                    at += 1;
                }
            }
        }
        Ok(())
    }

    /// Takes the frame that begins with `letter`; `None` where there is none.
    fn take(
        &mut self,
        letter: u8,
        cursor: &mut Cursor,
        at: usize,
        sink: &mut dyn FrameSink,
    ) -> Result<Option<Event>, String> {
        let event = match letter {
            b'E' => match self.event(cursor) {
                Ok(Some(event)) => event,
                _ => return Ok(None),
            },
            b'H' | b'G' | b'S' => {
                let Some(numbers) = self.slow_frame(letter, cursor, at) else { return Ok(None) };
                self.keep(letter, numbers, sink)?;
                return Ok(Some(Event::Other));
            }
            b'I' | b'P' => {
                if self.main_frame(letter, cursor, at).is_none() {
                    return Ok(None);
                }
                self.judge(letter, at, sink)?;
                return Ok(Some(Event::Other));
            }
            _ => return Ok(None),
        };
        if matches!(event, Event::End) {
            return Ok(Some(event));
        }
        if !ends_well(cursor, at) {
            return Ok(None);
        }
        if let Event::Resume(stamp) = event {
            self.doubted = Some(stamp);
        }
        Ok(Some(event))
    }

    /// The numbers of a frame of what changes slowly: home, GPS, the flight's state.
    fn slow_frame(&self, letter: u8, cursor: &mut Cursor, at: usize) -> Option<Vec<i32>> {
        let fields = match letter {
            b'H' => &self.header.home,
            b'G' => &self.header.gps,
            _ => &self.header.slow,
        };
        let fields = fields.as_ref()?;
        let mut numbers = vec![0; fields.names.len()];
        self.numbers(fields, cursor, None, &mut numbers).ok()?;
        ends_well(cursor, at).then_some(numbers)
    }

    /// Reads a frame of the loop's own numbers into the current ones.
    fn main_frame(&mut self, letter: u8, cursor: &mut Cursor, at: usize) -> Option<()> {
        let header = self.header;
        let fields = if letter == b'I' { Some(&header.intra) } else { header.inter.as_ref() }?;
        let mut current = std::mem::take(&mut self.current);
        let differences = (letter == b'P').then_some(());
        let read = self.numbers(fields, cursor, differences, &mut current);
        self.current = current;
        (read.is_ok() && ends_well(cursor, at)).then_some(())
    }

    /// Reads the numbers of one frame; `differences` to the frames before, where it has them.
    fn numbers(
        &self,
        fields: &FrameFields,
        cursor: &mut Cursor,
        differences: Option<()>,
        numbers: &mut [i32],
    ) -> Result<(), BrokenOff> {
        let mut values = [0_i32; 8];
        for group in &fields.groups {
            read_group(group, cursor, &mut values)?;
            for (place, value) in (group.first..).zip(values.iter().take(group.count)) {
                let predicted = self.predicted(fields, place, differences.is_some(), numbers);
                if let Some(number) = numbers.get_mut(place) {
                    *number = predicted.wrapping_add(*value);
                }
            }
        }
        Ok(())
    }

    /// What the number at `place` is added to. Arithmetic of 32 bits that overflows, as the firmware's.
    fn predicted(&self, fields: &FrameFields, place: usize, differences: bool, numbers: &[i32]) -> i32 {
        let number = |of: &[i32]| of.get(place).copied().unwrap_or(0);
        let before = |of: &[i32]| if differences { number(of) } else { 0 };
        match fields.predictors.get(place) {
            Some(Predictor::Previous) => before(&self.previous),
            Some(Predictor::StraightLine) => {
                before(&self.previous).wrapping_mul(2).wrapping_sub(before(&self.before))
            }
            Some(Predictor::Average) => {
                let sum = i64::from(before(&self.previous)) + i64::from(before(&self.before));
                // Half of a sum of two numbers of 32 bits is one of 32 bits.
                i32::try_from(sum / 2).unwrap_or(0)
            }
            Some(Predictor::Constant(constant)) => *constant,
            Some(Predictor::Motor0(motor)) => numbers.get(*motor).copied().unwrap_or(0),
            Some(Predictor::Increment) => {
                let left_out = self.last.map_or(0, |last| self.header.left_out_after(last.turn));
                before(&self.previous).wrapping_add(1).wrapping_add(left_out.cast_signed())
            }
            Some(Predictor::Home(coordinate)) => {
                self.home.as_ref().and_then(|home| home.get(*coordinate)).copied().unwrap_or(0)
            }
            Some(Predictor::LastTime) => self.last.map_or(0, |last| last.microseconds.cast_signed()),
            Some(Predictor::Zero) | None => 0,
        }
    }

    /// Believes a main frame or not, by its turn and time.
    fn judge(&mut self, letter: u8, at: usize, sink: &mut dyn FrameSink) -> Result<(), String> {
        let number = |place: usize| self.current.get(place).copied().unwrap_or(0).cast_unsigned();
        let stamp =
            Stamp { turn: self.header.iteration.map_or(0, number), microseconds: number(self.header.time) };
        let subject = if letter == b'I' { "I" } else { "P" };
        if letter == b'P' && !self.follows {
            sink.skip("frame_without_reference", subject, at);
            return Ok(());
        }
        let follows = |from: Option<Stamp>| from.is_some_and(|from| from.leads_to(stamp));
        let first = self.last.is_none() && self.doubted.is_none();
        let believed = first || follows(self.last) || letter == b'I' && follows(self.doubted);
        if !believed {
            self.follows = false;
            if letter == b'I' {
                self.doubted = Some(stamp);
            }
            sink.skip("jump_in_time", subject, at);
            return Ok(());
        }
        self.microseconds = match self.last {
            // The clock overflows every 71 minutes; what follows a doubted stamp may also lie before.
            Some(last) => {
                let ahead = stamp.microseconds.wrapping_sub(last.microseconds).cast_signed();
                self.microseconds.saturating_add(i64::from(ahead))
            }
            None => i64::from(stamp.microseconds),
        };
        (self.last, self.doubted, self.follows) = (Some(stamp), None, true);
        sink.main(self.microseconds, &self.current)?;
        if letter == b'I' {
            self.previous.clone_from(&self.current);
            self.before.clone_from(&self.current);
        } else {
            std::mem::swap(&mut self.before, &mut self.previous);
            self.previous.clone_from(&self.current);
        }
        Ok(())
    }

    /// Hands on a frame that is not of the main ones.
    fn keep(&mut self, letter: u8, numbers: Vec<i32>, sink: &mut dyn FrameSink) -> Result<(), String> {
        match letter {
            b'H' => self.home = Some(numbers),
            b'S' => sink.slow(&numbers)?,
            _ => {
                let Some(fields) = &self.header.gps else { return Ok(()) };
                let needs_home =
                    |place: usize| matches!(fields.predictors.get(place), Some(Predictor::Home(_)));
                let known = |(place, number)| (self.home.is_some() || !needs_home(place)).then_some(number);
                let own = fields.place("time").and_then(|place| numbers.get(place)).map(|time| {
                    let last = self.last.map_or(0, |last| last.microseconds.cast_signed());
                    self.microseconds.saturating_add(i64::from(time.wrapping_sub(last)))
                });
                sink.gps(own, &numbers.into_iter().enumerate().map(known).collect::<Vec<_>>())?;
            }
        }
        Ok(())
    }

    /// Reads past an event; `None` where it is of no kind that there is.
    fn event(&self, cursor: &mut Cursor) -> Result<Option<Event>, BrokenOff> {
        let kind = cursor.byte()?;
        match kind {
            // A beep, disarming, and what Rotorflight reports of its governor.
            0 | 15 | 50..=52 => drop(cursor.unsigned()?),
            10 => cursor.skip(5)?,
            11 => cursor.skip(4)?,
            12 => cursor.skip(8)?,
            13 => {
                if cursor.byte()? < 128 {
                    cursor.signed()?;
                } else {
                    cursor.skip(4)?;
                }
            }
            14 => {
                let (turn, microseconds) = (cursor.unsigned()?, cursor.unsigned()?);
                return Ok(Some(Event::Resume(Stamp { turn, microseconds })));
            }
            20 => {
                cursor.skip(1)?;
                cursor.signed()?;
                cursor.skip(2)?;
            }
            30 => {
                cursor.unsigned()?;
                cursor.unsigned()?;
            }
            // A failure of the IMU with INAV, a test of latency with all others.
            40 if self.header.text("Firmware revision").is_some_and(|it| it.starts_with("INAV")) => {
                cursor.unsigned()?;
            }
            40 => cursor.skip(5)?,
            // Data and text of Rotorflight's users.
            100 | 101 => {
                let length = cursor.byte()?;
                cursor.skip(usize::from(length))?;
            }
            255 if cursor.starts_with(b"End of log") => return Ok(Some(Event::End)),
            _ => return Ok(None),
        }
        Ok(Some(Event::Other))
    }
}

/// Whether a frame that began at `start` is no longer than frames are, and another one or the end stands behind it.
fn ends_well(cursor: &Cursor, start: usize) -> bool {
    cursor.at - start <= LONGEST_FRAME && cursor.peek().is_none_or(|next| LETTERS.contains(&next))
}
