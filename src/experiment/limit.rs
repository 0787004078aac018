//! What of an experiment the guard would clip.

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
