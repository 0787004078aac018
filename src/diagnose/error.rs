//! Why there is no diagnosis, or no extension.

use super::diagnosis::ErrorSummary;
use super::refusal::EffectRefusal;
use crate::model::ModelError;
use crate::screening::{Finding, ScreeningError};
use crate::unit::short;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The model cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A log that cannot be used, or none that any block of the model can be compared with.
    #[error(transparent)]
    Screening(#[from] ScreeningError),
    /// An effect cannot be added from these logs.
    #[error("effect `{effect}`: {why}")]
    Refused {
        /// Id.
        effect: String,
        /// Why.
        why: EffectRefusal,
    },
    /// The logs cannot tell anything of the base's numbers.
    #[error("nothing to take over: {0}")]
    NothingToRefit(EffectRefusal),
    /// No number of the model has to change.
    #[error("nothing to change: these logs do not ask for other numbers than the model has")]
    NothingChanged {
        /// The error of the model, which stays.
        error: Box<ErrorSummary>,
        /// Nothing but noise is left.
        is_at_floor: bool,
        /// What to know about the logs.
        findings: Vec<Finding>,
    },
    /// A number that no bench has: what was not measured (a rate that stood still, or read zero) asks for such.
    #[error(
        "nothing to take over: `{name}` would go from {} to {}, which these logs do not determine or no bench has: a rate that \
         stood still or reads zero was not measured; leave that part of the log out",
        short(*from),
        short(*to)
    )]
    AbsurdNumber {
        /// Name of the number.
        name: String,
        /// Its value in the model, in its SI unit.
        from: f64,
        /// What the logs ask for.
        to: f64,
    },
    /// Logs that cannot come from one bench.
    #[error(
        "{log} and {other_log} are not of one bench: alone the first gives {parameter} = {value:.6}, the second {other:.6}; diagnose each by itself"
    )]
    DifferentBenches {
        /// The number in which they differ.
        parameter: String,
        /// One log.
        log: String,
        /// Its value, in the parameter's SI unit.
        value: f64,
        /// The other log.
        other_log: String,
        /// Its value.
        other: f64,
    },
    /// An expression has no value on the data.
    #[error("effect `{effect}`: its expression is not a number on {log} at {} s ({})", short(*time), signals.join(", "))]
    NotANumber {
        /// Id of the user's effect.
        effect: String,
        /// The log.
        log: String,
        /// [s] where.
        time: f64,
        /// What the expression saw there.
        signals: Vec<String>,
    },
}
