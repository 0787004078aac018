//! What a free run of a rotor takes and gives.

/// Most states of laws with memory.
pub(super) const MOST_STATES: usize = 8;

/// Inputs of a rotor over a stretch without holes; each value holds until the next sample.
#[derive(Debug, Clone, Copy)]
pub struct RotorInput<'a> {
    /// [s] rising.
    pub time: &'a [f64],
    /// [-] u.
    pub command: &'a [f64],
    /// [s] from when on each command is in force, where that is not its row; `None` = from its row on.
    pub command_from: Option<&'a [f64]>,
    /// [V] v_b; `None` = full battery.
    pub voltage: Option<&'a [f64]>,
    /// +1 rotor 1, -1 rotor 2.
    pub side: f64,
}

impl<'a> RotorInput<'a> {
    /// [s] from when on each command is in force.
    pub(super) fn since(&self) -> &'a [f64] {
        self.command_from.unwrap_or(self.time)
    }
}

/// Where a free run starts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RotorStart {
    /// [rad/s] rate at the first sample; `None` = the steady one.
    pub rate: Option<f64>,
    /// Departure of slow states (heat) from the steady state at the first sample.
    pub slow: f64,
    /// What the laws with memory remember of the segment before; `None` = the steady state.
    pub before: Option<Remembered>,
    /// Here the log begins, and what was commanded before is not known: a rotor with a dead time goes on as it is found until the
    /// first command arrives. Behind a hole that command was probably in force already.
    pub is_first: bool,
}

/// States of laws with memory at the end of a stretch, and how long ago that was: heat outlives a hole in the log, a
/// filter's state does not.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Remembered {
    pub(super) states: [f64; MOST_STATES],
    /// [s] from the last sample of the stretch before to the first of this one.
    pub hole: f64,
}

/// What a free run gives, at the samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RotorTrace {
    /// [rad/s] the rotor's rate.
    pub rate: Vec<f64>,
    /// [rad/s] what its sensor would read.
    pub measured: Vec<f64>,
    /// [rad/s] mean rate over the interval after each sample; the last one repeats the rate.
    pub mean: Vec<f64>,
    /// [rad²/s²] mean of the squared rate over the interval after each sample, the last one of the rate there; `None` where
    /// nobody asked for it.
    pub mean_square: Option<Vec<f64>>,
    /// States of laws with memory at the last sample.
    pub(super) end: [f64; MOST_STATES],
}

impl RotorTrace {
    /// A trace that takes down the mean of the squared rate, too.
    #[must_use]
    pub fn with_squares() -> Self {
        Self { mean_square: Some(Vec::new()), ..Self::default() }
    }

    /// Forgets a run before the next.
    pub(super) fn clear(&mut self) {
        self.rate.clear();
        self.measured.clear();
        self.mean.clear();
        self.mean_square.iter_mut().for_each(Vec::clear);
    }

    /// At the last sample there is no interval any more: means are those of the rate there.
    pub(super) fn finish(&mut self, end: [f64; MOST_STATES]) {
        let last = self.rate.last().copied();
        self.mean.extend(last);
        self.mean_square.iter_mut().for_each(|all| all.extend(last.map(|rate| rate * rate)));
        self.end = end;
    }

    /// What a stretch that begins `hole` [s] after this one remembers of it.
    #[must_use]
    pub fn remembered(&self, hole: f64) -> Remembered {
        Remembered { states: self.end, hole }
    }
}
