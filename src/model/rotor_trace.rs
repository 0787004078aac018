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
    /// [s] time until which that rate holds, whatever is commanded; `None` = the rotor follows at once.
    pub rate_holds_until: Option<f64>,
    /// Departure of slow states (heat) from the steady state at the first sample.
    pub slow: f64,
    /// What the laws with memory remember of the segment before; `None` = the steady state.
    pub before: Option<Remembered>,
    /// Here the log begins, and what was commanded before is not known: a rotor with a dead time goes on as it is found until the
    /// first command arrives. Behind a hole that command was probably in force already.
    pub is_first: bool,
}

impl RotorStart {
    /// [s] until when a rotor goes on as it is found: its first command arrives then, or its rate is known of that time.
    pub(super) fn goes_on_until(&self, arrival: f64) -> f64 {
        let arrival = if self.is_first { arrival } else { f64::NEG_INFINITY };
        self.rate_holds_until.map_or(arrival, |known| known.max(arrival))
    }
}

/// States of laws with memory at the end of a stretch, and how long ago that was: heat and the level of a relay outlive a hole in the
/// log, a filter's state does not.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Remembered {
    pub(super) states: [f64; MOST_STATES],
    /// Of the laws on the command, each at its place; `None` of one without memory.
    pub(super) command: [Option<f64>; MOST_STATES],
    /// [s] from the last sample of the stretch before to the first of this one.
    pub(super) hole: f64,
}

impl Remembered {
    /// What a stretch at `time` [s] remembers of the one before it: when that ended, and in what.
    #[must_use]
    pub fn at_begin(before: Option<(f64, Self)>, time: &[f64]) -> Option<Self> {
        before.zip(time.first()).map(|((ended, end), begins)| end.across(begins - ended))
    }

    /// The same for a stretch that begins `hole` [s] later.
    #[must_use]
    pub fn across(self, hole: f64) -> Self {
        Self { hole, ..self }
    }
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
    /// What a stretch remembers that begins at once; `None` where the run did not come to its end.
    pub(crate) end: Option<Remembered>,
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
        self.end = None;
    }
}

/// Takes a free run down, row by row.
pub(super) trait TakeDown {
    /// Whether it takes down the mean of the squared rate: two divisions more a row.
    fn wants_squares(&self) -> bool;

    /// Whether it takes down what the rotor turned by.
    fn wants_means(&self) -> bool;

    /// At a row: rate and what its sensor would read [rad/s].
    fn row(&mut self, rate: f64, measured: f64);

    /// Over the interval behind it [s]: the integrals of the rate [rad] and of its square [rad²/s].
    fn interval(&mut self, span: f64, turned: f64, squares: f64);

    /// At the last row: its rate [rad/s], and the states of laws with memory.
    fn finish(&mut self, rate: f64, end: [f64; MOST_STATES]);

    /// Behind that: the states of the laws on the command.
    fn finish_command(&mut self, end: [Option<f64>; MOST_STATES]);
}

impl TakeDown for RotorTrace {
    fn wants_squares(&self) -> bool {
        self.mean_square.is_some()
    }

    fn wants_means(&self) -> bool {
        true
    }

    fn row(&mut self, rate: f64, measured: f64) {
        self.rate.push(rate);
        self.measured.push(measured);
    }

    fn interval(&mut self, span: f64, turned: f64, squares: f64) {
        self.mean.push(turned / span);
        if let Some(all) = &mut self.mean_square {
            all.push(squares / span);
        }
    }

    /// There is no interval any more: means are those of the rate there.
    fn finish(&mut self, rate: f64, end: [f64; MOST_STATES]) {
        self.mean.push(rate);
        self.mean_square.iter_mut().for_each(|all| all.push(rate * rate));
        self.end = Some(Remembered { states: end, ..Remembered::default() });
    }

    fn finish_command(&mut self, end: [Option<f64>; MOST_STATES]) {
        self.end = self.end.map(|it| Remembered { command: end, ..it });
    }
}

/// Of a free run what its sensor would read [rad/s], and nothing else.
pub(super) struct Readings<'a> {
    /// Those to come.
    pub out: std::slice::IterMut<'a, f64>,
    /// States of laws with memory at the last row.
    pub end: Remembered,
}

impl TakeDown for Readings<'_> {
    fn wants_squares(&self) -> bool {
        false
    }

    fn wants_means(&self) -> bool {
        false
    }

    fn row(&mut self, _: f64, measured: f64) {
        if let Some(out) = self.out.next() {
            *out = measured;
        }
    }

    fn interval(&mut self, _: f64, _: f64, _: f64) {}

    fn finish(&mut self, _: f64, end: [f64; MOST_STATES]) {
        self.end.states = end;
    }

    fn finish_command(&mut self, end: [Option<f64>; MOST_STATES]) {
        self.end.command = end;
    }
}
