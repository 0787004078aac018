//! Why an experiment cannot be run.

use super::limit::LimitError;
use crate::unit::short;

/// Why an experiment cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExperimentError {
    /// A setting outside its range.
    #[error("experiment: `{name}` must lie in {}..{}, not {}", short(*low), short(*high), short(*value))]
    Range {
        /// Name of the setting.
        name: &'static str,
        /// Value found.
        value: f64,
        /// Lowest value allowed.
        low: f64,
        /// Highest value allowed.
        high: f64,
    },
    /// It would command a rotor beyond 0..1.
    #[error(
        "experiment: rotor {rotor} would be commanded to {} at {time_s:.2} s; a command lies in 0..1", short(*value)
    )]
    Impossible {
        /// Rotor, from 1.
        rotor: usize,
        /// Command asked for.
        value: f64,
        /// [s] since the start.
        time_s: f64,
    },
    /// A ramp whose lower end is above its upper one.
    #[error("experiment: a ramp's `low`, {}, must lie below its `high`, {}", short(*low), short(*high))]
    Upside {
        /// [-]
        low: f64,
        /// [-]
        high: f64,
    },
    /// More chips than the longest sequence has.
    #[error("experiment: the PRBS would need {needed} chips; the longest sequence has {longest}")]
    TooLong {
        /// Chips asked for.
        needed: u64,
        /// Chips there are.
        longest: u64,
    },
    /// The guard would change it.
    #[error(transparent)]
    Clipped(#[from] LimitError),
}
