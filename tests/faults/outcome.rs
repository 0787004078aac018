//! What came of one run: what found the fault and when, how it ended, what the rotors got, and what must never be.

use rotorbench::can::Counts;
use rotorbench::emulate::Truth;
use rotorbench::guard::{Cause, State};
use rotorbench::signal::{Applied, AppliedFlags, GuardEvent};

use crate::bench::{Parts, cause_of};
use crate::fault::{Expect, Row};

/// [-] what the bus rounds a command by: half a step of `dbc/bench.dbc`.
const ROUNDING: f64 = 1e-5;

/// What came of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// First state that the guard left because of the fault: periods after it, and why.
    pub first: Option<(u64, Cause)>,
    /// State at the end, and the cause that led there; `None` when nobody guards any more.
    pub end: Option<(State, Cause)>,
    /// [-] highest command that an ESC obeyed from the fault on.
    pub highest: f64,
    /// Periods from the fault until both rotors were commanded to zero for good; `None` = not in this run.
    pub turning: Option<u64>,
    /// Whether the guard cut a command to its limits.
    pub limited: bool,
    /// Records that the recorder refused, and counted.
    pub recorder_refused: u64,
    /// Frames and values that the bridge refused, by cause.
    pub refused: Counts,
    /// Everything the rotors did, as one number: the same seed, the same number.
    pub digest: u64,
    /// What must never be, and was.
    pub broken: Vec<String>,
}

/// Looks on at a run.
pub struct Track {
    expect: Expect,
    from: u64,
    hold: u64,
    ramp: u64,
    maximum: f64,
    period_s: f64,
    first: Option<(u64, Cause)>,
    end: Option<(State, Cause)>,
    latched_at: Option<u64>,
    highest: f64,
    last_turning: Option<u64>,
    beyond: usize,
    may_be_beyond: usize,
    slots: u64,
    ran: bool,
    limited: bool,
    pub recorder_refused: u64,
    digest: u64,
    broken: Vec<String>,
}

impl Track {
    pub fn new(row: &Row, parts: &Parts, from: u64) -> Self {
        Self {
            expect: row.expect,
            from,
            hold: parts.hold,
            ramp: u64::from(parts.guard.ramp_periods()),
            maximum: parts.maximum,
            period_s: parts.period_ns as f64 * 1e-9,
            first: None,
            end: None,
            latched_at: None,
            highest: 0.0,
            last_turning: None,
            beyond: 0,
            may_be_beyond: row.periods_beyond(),
            slots: 0,
            ran: false,
            limited: false,
            recorder_refused: 0,
            // FNV-1a.
            digest: 0xcbf2_9ce4_8422_2325,
            broken: Vec::new(),
        }
    }

    fn fold(&mut self, bits: u64) {
        for byte in bits.to_le_bytes() {
            self.digest = (self.digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn broke(&mut self, slot: u64, what: String) {
        if self.broken.len() < 5 {
            self.broken.push(format!("slot {slot}, fault at {}: {what}", self.from));
        }
    }

    pub fn event(&mut self, slot: u64, event: &GuardEvent) {
        let (from, to, cause) = cause_of(event);
        if slot >= self.from && from != to && self.first.is_none() {
            self.first = Some((slot - self.from, cause));
        }
        let is_latch = |state| matches!(state, State::FailsafeLatched | State::EmergencyStop);
        if is_latch(from) && from != to && !is_latch(to) {
            self.broke(slot, format!("{from} was left for {to} by itself"));
        }
        if is_latch(to) && !is_latch(from) {
            self.latched_at = Some(slot);
        }
    }

    /// One slot: what left the guard (`None` = it is dead), what the ESCs obey, what really is.
    pub fn see(&mut self, slot: u64, applied: Option<Applied>, obeyed: [f64; 2], truth: &Truth) {
        self.slots = slot + 1;
        self.end = None;
        if let Some(applied) = applied {
            let state = State::from_code(applied.state).unwrap_or_default();
            self.end = Some((state, Cause::from_code(applied.cause).unwrap_or_default()));
            self.ran |= state == State::Armed && slot + 1 == self.from;
            if applied.rotor.iter().any(|u| !(0.0..=self.maximum).contains(u)) {
                self.broke(slot, format!("{:?} left the guard", applied.rotor));
            }
            self.limited |= slot >= self.from && applied.flags & AppliedFlags::LIMITED != 0;
            applied.rotor.iter().for_each(|u| self.fold(u.to_bits()));
            self.fold(u64::from(applied.state) << 32 | u64::from(applied.cause));
        }
        obeyed.iter().for_each(|u| self.fold(u.to_bits()));
        self.fold(truth.body_angle.to_bits());
        let highest = obeyed.iter().fold(0.0, |most: f64, u| most.max(*u));
        self.beyond += usize::from(highest > self.maximum + ROUNDING);
        if highest > self.maximum + ROUNDING
            && self.beyond > self.may_be_beyond
            && self.expect != Expect::Beyond
        {
            self.broke(slot, format!("an ESC obeys {highest}"));
        }
        if slot >= self.from {
            self.highest = self.highest.max(highest);
        }
        if highest > 0.0 {
            self.last_turning = Some(slot);
            // The ramp, or, where no frame gets through, the ESCs' own timeout, which is the hold; and a period for each
            // of the two slots in which the latch and the last frame may fall.
            let longest = self.ramp.max(self.hold) + 2;
            let late = self.latched_at.is_some_and(|at| slot > at + longest);
            if late && self.expect != Expect::Beyond {
                self.broke(slot, format!("a rotor is commanded to {highest} after the latch"));
            }
        }
    }

    /// Sums up.
    pub fn outcome(mut self, refused: &Counts) -> Outcome {
        let end = self.slots;
        let turning = match self.last_turning {
            Some(last) if last + 1 == self.slots => None,
            Some(last) => Some((last + 1).saturating_sub(self.from)),
            None => Some(0),
        };
        if !self.ran {
            self.broke(end, "the bench did not run when the fault came".to_owned());
        }
        let limit = match self.expect {
            Expect::Stops(more) => Some(self.hold + more),
            Expect::StopsBy(seconds) => Some((seconds / self.period_s).ceil() as u64 + self.ramp + 2),
            _ => None,
        };
        if let Some(limit) = limit
            && turning.is_none_or(|periods| periods > limit)
        {
            self.broke(end, format!("the rotors turn for {turning:?} periods, more than {limit}"));
        }
        if self.expect == Expect::RunsOn && turning.is_some() {
            self.broke(end, format!("the run ended: {:?}, {:?}", self.first, self.end));
        }
        Outcome {
            first: self.first,
            end: self.end,
            highest: self.highest,
            turning,
            limited: self.limited,
            recorder_refused: self.recorder_refused,
            refused: *refused,
            digest: self.digest,
            broken: self.broken,
        }
    }
}
