//! What to measure of the machine's punctuality.

use super::cyclictest::Cyclictest;
use crate::bench::BenchConfig;
use crate::runtime::ProcessError;
use crate::studies::thresholds::THRESHOLDS;

/// What to measure.
#[derive(Debug, Clone)]
pub struct JitterConfig {
    /// Period, real-time settings, controller, model and bus.
    pub bench: BenchConfig,
    /// [s] for each stage, over all rounds.
    pub seconds: f64,
    /// How often the stages take turns.
    pub rounds: u32,
    /// Whether the user named the interface: only then is a bus measured that may be a real one.
    pub is_interface_named: bool,
    /// cyclictest, where it is to be measured beside us.
    pub cyclictest: Option<Cyclictest>,
}

impl JitterConfig {
    /// Checks what is asked for.
    ///
    /// # Errors
    /// [`ProcessError::Jitter`], a period or a priority that cannot be.
    pub fn check(&self) -> Result<(), ProcessError> {
        self.bench.check()?;
        self.bench.real_time.check()?;
        let each_s = self.seconds / f64::from(self.rounds.max(1));
        // Not-a-number is refused, too.
        if !(1..=THRESHOLDS.most_rounds).contains(&self.rounds)
            || !(THRESHOLDS.shortest_stage_s..=86_400.0).contains(&each_s)
        {
            return Err(ProcessError::Jitter { seconds: self.seconds, rounds: self.rounds });
        }
        if each_s < THRESHOLDS.fewest_periods * self.bench.period_s {
            return Err(ProcessError::Jitter { seconds: self.seconds, rounds: self.rounds });
        }
        Ok(())
    }

    /// Slots of a stage in each round.
    pub(super) fn slots(&self) -> u64 {
        (self.seconds / f64::from(self.rounds) / self.bench.period_s).round() as u64
    }
}
