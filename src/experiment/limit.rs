//! Holds an experiment against the guard's limits before it starts.

use super::Experiment;
use crate::guard::Limits;

/// Which limit the guard would clip an experiment at, and where.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// A command beyond the highest.
    #[error(
        "the guard's limit `{limit}` = {allowed} would clip the experiment: rotor {rotor} is commanded to {value:.4} at {time_s:.2} s"
    )]
    Level {
        /// Key in `[guard]`.
        limit: &'static str,
        /// [-] its value.
        allowed: f64,
        /// Rotor, from 1.
        rotor: usize,
        /// [-] command asked for.
        value: f64,
        /// [s] since the start.
        time_s: f64,
    },
    /// A change faster than the slew limit.
    #[error(
        "the guard's limit `{limit}` = {allowed} 1/s would clip the experiment: rotor {rotor} moves by {step:.4} in one period of {period_s} s at {time_s:.2} s, which is {rate:.2} 1/s"
    )]
    Slew {
        /// Key in `[guard]`.
        limit: &'static str,
        /// [1/s] its value.
        allowed: f64,
        /// Rotor, from 1.
        rotor: usize,
        /// [-] change in one period.
        step: f64,
        /// [1/s] rate asked for.
        rate: f64,
        /// [s]
        period_s: f64,
        /// [s] since the start.
        time_s: f64,
    },
}

impl Experiment {
    /// Refuses what the guard would clip.
    ///
    /// # Errors
    /// [`LimitError`], naming the first limit that is met and where.
    pub fn check(&self, limits: &Limits) -> Result<(), LimitError> {
        // Rounding of slot times must not turn a slope that just fits into one that does not.
        const ROUNDING: f64 = 1e-9;
        let period_s = self.period_s();
        let mut before = [0.0; 2];
        for slot in 0..self.slots() {
            let time_s = slot as f64 * period_s;
            for (index, value) in self.command(slot).into_iter().enumerate() {
                let rotor = index + 1;
                if value > limits.maximum + ROUNDING {
                    let (limit, allowed) = ("rotor_maximum", limits.maximum);
                    return Err(LimitError::Level { limit, allowed, rotor, value, time_s });
                }
                let step = value - before[index];
                let rate = step.abs() / period_s;
                if rate > limits.slew_per_s * (1.0 + ROUNDING) {
                    let (limit, allowed) = ("slew_per_s", limits.slew_per_s);
                    return Err(LimitError::Slew { limit, allowed, rotor, step, rate, period_s, time_s });
                }
                before[index] = value;
            }
        }
        Ok(())
    }
}
