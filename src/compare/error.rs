//! Why nothing could be compared.

use crate::model::ModelError;
use crate::screening::ScreeningError;
use crate::unit::short;

/// Why nothing could be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A log that cannot be used.
    #[error(transparent)]
    Screening(#[from] ScreeningError),
    /// A law that the model has gives no number on the data.
    #[error("model `{model}`: the expression of `{effect}` is not a number on {log} at {} s ({})", short(*time), signals.join(", "))]
    NotANumber {
        /// Name of the model.
        model: String,
        /// Id of the user's effect.
        effect: String,
        /// The log.
        log: String,
        /// [s] where.
        time: f64,
        /// What the expression saw there.
        signals: Vec<String>,
    },
    /// Too few samples.
    #[error("{log}: {samples} samples; at least {needed} are needed")]
    TooShort {
        /// The log.
        log: String,
        /// How many there are.
        samples: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The horizon is not a time.
    #[error("horizon {} s: it must lie in 0.01..600", short(*.0))]
    Horizon(f64),
    /// The model cannot run.
    #[error(transparent)]
    Model(#[from] ModelError),
}
