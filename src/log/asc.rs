//! The text log of Vector's tools (ASC): a line for each frame of a bus.
//!
//! A channel is called by its number, from 1. Stamps count from the start of the measurement: the date above them is in the
//! words of the language and in the time zone of whoever recorded.

use std::path::Path;

use super::candump::CandumpFrame;
use super::format::{FormatError, Start};
use super::tables::Skipped;
use crate::cancel;
use crate::recording::raw_frame::{FrameFlags, RawFrame};

/// Name of the format, as its users call it.
pub const NAME: &str = "Vector ASC";

/// Lines between two looks at whether the end was asked for.
const CHECK_EVERY: usize = 4096;

/// [byte] No frame's line is longer.
const LONGEST_LINE: usize = 4096;

/// Bytes by the length code of an FD frame.
const FD_LENGTHS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

/// Whether a file that begins so is one: above its lines it says how their numbers are written.
#[must_use]
pub fn recognises(start: &Start) -> bool {
    let mut lines = start.bytes.split(|byte| *byte == b'\n');
    lines.any(|line| std::str::from_utf8(line).is_ok_and(|line| Header::default().take(line)))
}

/// The frames in `bytes`, and what was left out; `path` is for messages.
///
/// # Errors
/// [`FormatError`] when there is no frame in it.
pub fn read(path: &Path, bytes: &[u8]) -> Result<(Vec<CandumpFrame>, Vec<Skipped>), FormatError> {
    let (mut frames, mut skipped) = (Vec::new(), Vec::new());
    let mut header = Header::default();
    let (mut byte, mut last_ns) = (0, 0_u64);
    for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        if index.is_multiple_of(CHECK_EVERY) {
            cancel::check();
        }
        let at = byte;
        byte += line.len() + 1;
        let line = std::str::from_utf8(line.get(..line.len().min(LONGEST_LINE)).unwrap_or_default())
            .unwrap_or_default();
        if header.take(line) {
            continue;
        }
        match header.frame(line) {
            Line::Frame(mut frame) => {
                if header.relative {
                    frame.frame.stamp_ns = frame.frame.stamp_ns.saturating_add(last_ns);
                }
                last_ns = frame.frame.stamp_ns;
                frames.push(frame);
            }
            // Events stand between the frames, and count in the time from line to line.
            Line::Event(stamp_ns) => {
                last_ns = if header.relative { last_ns.saturating_add(stamp_ns) } else { stamp_ns }
            }
            Line::Damaged => Skipped::count(&mut skipped, "damaged_line", "", at as u64),
            Line::Other => {}
        }
    }
    if frames.is_empty() {
        return Err(FormatError::Damaged {
            path: path.to_owned(),
            format: NAME,
            byte: 0,
            reason: "there is no line of a frame in it".to_owned(),
        });
    }
    Ok((frames, skipped))
}

/// What a line is.
enum Line {
    Frame(CandumpFrame),
    /// Something else with a stamp.
    Event(u64),
    /// A frame that cannot be read.
    Damaged,
    Other,
}

/// How the lines are written.
struct Header {
    /// Of identifiers, lengths and data.
    base: u32,
    /// Stamps are the time since the line before.
    relative: bool,
}

impl Default for Header {
    fn default() -> Self {
        Self { base: 16, relative: false }
    }
}

impl Header {
    /// Takes in the line that says it, `base hex  timestamps absolute`; whether it was that.
    fn take(&mut self, line: &str) -> bool {
        let mut words = line.split_ascii_whitespace().map(str::to_ascii_lowercase);
        if words.next().as_deref() != Some("base") {
            return false;
        }
        self.base = match words.next().as_deref() {
            Some("hex") => 16,
            Some("dec") => 10,
            _ => return false,
        };
        self.relative = words.any(|word| word == "relative");
        true
    }

    fn frame(&self, line: &str) -> Line {
        let mut words = line.split_ascii_whitespace();
        let Some(stamp_ns) = words.next().and_then(nanoseconds) else { return Line::Other };
        let words: Vec<&str> = words.collect();
        let is_direction = |word: &&str| ["rx", "tx", "txrq"].contains(&word.to_ascii_lowercase().as_str());
        let parsed = match words.as_slice() {
            ["CANFD", channel, direction, word, ..] if is_direction(direction) && is_error(word) => {
                Some((channel, error(sent(direction))))
            }
            ["CANFD", channel, direction, rest @ ..] if is_direction(direction) => {
                self.fd(direction, rest).map(|frame| (channel, frame))
            }
            [channel, word, ..] if is_number(channel) && is_error(word) => Some((channel, error(0))),
            [channel, id, direction, rest @ ..] if is_number(channel) && is_direction(direction) => {
                self.classic(id, direction, rest).map(|frame| (channel, frame))
            }
            _ => return Line::Event(stamp_ns),
        };
        let Some((channel, mut frame)) = parsed.filter(|(channel, _)| is_number(channel)) else {
            return Line::Damaged;
        };
        frame.stamp_ns = stamp_ns;
        Line::Frame(CandumpFrame { interface: (*channel).to_owned(), frame })
    }

    /// `d 8 00 11 ...`, or `r` with or without the length that is asked for.
    fn classic(&self, id: &str, direction: &str, words: &[&str]) -> Option<RawFrame> {
        let named = || {
            words
                .windows(3)
                .find_map(|words| (words[..2] == ["ID", "="]).then(|| identifier(words[2], 10))?)
        };
        let (id, extended) = identifier(id, self.base).or_else(named)?;
        let (kind, words) = words.split_first()?;
        let code = words.first().and_then(|word| u8::from_str_radix(word, self.base).ok());
        let flags = extended | sent(direction);
        if kind.eq_ignore_ascii_case("r") {
            let length = code.unwrap_or(0).min(8);
            return Some(RawFrame { id, flags: flags | FrameFlags::REMOTE, length, ..RawFrame::default() });
        }
        let mut frame = RawFrame { id, flags, length: code?.min(8), ..RawFrame::default() };
        self.fill(&mut frame, words.get(1..)?)?;
        Some(frame)
    }

    /// Identifier, name or none, bit rate switch, error state, length code, length, data.
    fn fd(&self, direction: &str, words: &[&str]) -> Option<RawFrame> {
        let (id, words) = words.split_first()?;
        let (id, extended) = identifier(id, self.base)?;
        let words = if words.first().is_some_and(|word| is_number(word)) { words } else { words.get(1..)? };
        let [switch, state, code, length, data @ ..] = words else { return None };
        let code = usize::from_str_radix(code, self.base).ok()?;
        let length: u8 = length.parse().ok().filter(|length| *length <= 64)?;
        let flags = extended | sent(direction);
        if length == 0 && code > 0 {
            let length = FD_LENGTHS.get(code).copied()?.min(8);
            return Some(RawFrame { id, flags: flags | FrameFlags::REMOTE, length, ..RawFrame::default() });
        }
        let is = |word: &str, flag: u32| if word == "1" { flag } else { 0 };
        let kind =
            FrameFlags::FD | is(switch, FrameFlags::BIT_RATE_SWITCH) | is(state, FrameFlags::ERROR_STATE);
        let mut frame = RawFrame { id, flags: flags | kind, length, ..RawFrame::default() };
        self.fill(&mut frame, data)?;
        Some(frame)
    }

    /// Puts in the bytes of a frame; `None` where one is missing or none.
    fn fill(&self, frame: &mut RawFrame, words: &[&str]) -> Option<()> {
        let words = words.get(..usize::from(frame.length))?;
        for (to, word) in frame.data.iter_mut().zip(words) {
            *to = u8::from_str_radix(word, self.base).ok()?;
        }
        Some(())
    }
}

fn is_error(word: &str) -> bool {
    word.eq_ignore_ascii_case("ErrorFrame")
}

/// That there was an error is all: what the controller saw, the kernel of a bench would say otherwise.
fn error(flags: u32) -> RawFrame {
    RawFrame { flags: flags | FrameFlags::ERROR, ..RawFrame::default() }
}

fn is_number(word: &str) -> bool {
    !word.is_empty() && word.bytes().all(|letter| letter.is_ascii_digit())
}

fn sent(direction: &str) -> u32 {
    if direction.eq_ignore_ascii_case("rx") { 0 } else { FrameFlags::SENT }
}

/// An identifier, with `x` behind it where it has 29 bits, and the flag for that.
fn identifier(word: &str, base: u32) -> Option<(u32, u32)> {
    let (number, flag, most) = match word.strip_suffix(['x', 'X']) {
        Some(number) => (number, FrameFlags::EXTENDED, 0x1fff_ffff),
        None => (word, 0, 0x7ff),
    };
    u32::from_str_radix(number, base).ok().filter(|id| *id <= most).map(|id| (id, flag))
}

/// [ns] of a time in seconds.
fn nanoseconds(word: &str) -> Option<u64> {
    let (seconds, fraction) = word.split_once('.')?;
    let digits =
        fraction.get(..fraction.len().min(9)).filter(|_| is_number(seconds) && is_number(fraction))?;
    let fraction = digits.parse::<u64>().ok()? * 10_u64.pow(9 - digits.len() as u32);
    seconds.parse::<u64>().ok()?.checked_mul(1_000_000_000)?.checked_add(fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_all(text: &str) -> (Vec<CandumpFrame>, Vec<(&'static str, u64)>) {
        let (frames, skipped) = read(Path::new("a.asc"), text.as_bytes()).expect("frames");
        (frames, skipped.into_iter().map(|it| (it.code, it.first_byte)).collect())
    }

    fn short(frames: &[CandumpFrame]) -> Vec<(u64, &str, u32, u32, &[u8])> {
        frames
            .iter()
            .map(|it| (it.frame.stamp_ns, &*it.interface, it.frame.id, it.frame.flags, it.frame.payload()))
            .collect()
    }

    #[test]
    fn lines_are_frames_by_what_stands_above_them() {
        let text = "date Sam Sep 30 15:06:13.191 2017\r\nbase dec  timestamps relative\r\n// version 9.0.0\r\n\
                    Begin Triggerblock Sam Sep 30 15:06:13.191 2017\r\n   0.500000 Start of measurement\r\n\
                    0.25 1  291  Rx   d 2 16 255  Length = 240015 BitCount = 124 ID = 291\r\n\
                    0.000001 2  17x  Tx   r\r\nEnd TriggerBlock\r\n";
        let (frames, skipped) = read_all(text);
        assert_eq!(
            short(&frames),
            [
                (750_000_000, "1", 291, 0, &[16, 255][..]),
                (750_001_000, "2", 17, FrameFlags::EXTENDED | FrameFlags::REMOTE | FrameFlags::SENT, &[][..]),
            ]
        );
        assert!(skipped.is_empty(), "{skipped:?}");
    }

    #[test]
    fn fd_frames_and_names_and_errors_are_read() {
        let text = "base hex  timestamps absolute\n\
                    1.0 CANFD   2 Rx        300  Name_12     1 0 9 12 1 2 3 4 5 6 7 8 9 a b c  102203 133 303000\n\
                    2.0 CANFD   3 Tx     50005x                                0 1 5 0 140000\n\
                    3.0 1  EngineData  Rx   d 1 FF  Length = 0 BitCount = 0 ID = 100\n\
                    4.0 1  ErrorFrame\n\
                    5.0 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n";
        let (frames, skipped) = read_all(text);
        let data: Vec<u8> = (1..=12).collect();
        assert_eq!(
            short(&frames),
            [
                (1_000_000_000, "2", 0x300, FrameFlags::FD | FrameFlags::BIT_RATE_SWITCH, &data[..]),
                (
                    2_000_000_000,
                    "3",
                    0x50005,
                    FrameFlags::EXTENDED | FrameFlags::REMOTE | FrameFlags::SENT,
                    &[0; 5][..]
                ),
                (3_000_000_000, "1", 100, 0, &[0xff][..]),
                (4_000_000_000, "1", 0, FrameFlags::ERROR, &[][..]),
            ]
        );
        assert!(skipped.is_empty(), "{skipped:?}");
    }

    #[test]
    fn damaged_lines_are_counted() {
        let text = "base hex\n1.0 1 100 Rx d 2 00 11\n2.0 1 100 Rx d 2 00 XX\n3.0 1 100 Rx d 2 00\n4.0 1 FFF Rx d 0\n";
        let (frames, skipped) = read_all(text);
        assert_eq!((frames.len(), skipped), (1, vec![("damaged_line", 32)]));
        let error = read(Path::new("a.asc"), b"base hex\n").expect_err("no frame").to_string();
        assert_eq!(error, "a.asc, byte 0: no Vector ASC log: there is no line of a frame in it");
    }

    #[test]
    fn a_file_is_known_by_its_header() {
        let is = |text: &str| recognises(&Start { bytes: text.as_bytes(), path: Path::new("a") });
        assert!(is("date Sam Sep 30 15:06:13.191 2017\nbase hex  timestamps absolute\n"));
        assert!(!is("(1735270496.916858) can0 110#00112233\n"));
        assert!(!is("time_s,base,hex\n0,1,2\n"));
    }
}
