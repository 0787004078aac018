//! The ladder: what was added to a model, from which log, and what it did to the error.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::measure::Measure;

/// A log that a step was made from.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogReference {
    /// File name.
    pub file: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// Rows of a log that the numbers of a model were identified from.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeenRows {
    /// File name.
    pub file: String,
    /// SHA-256 of its bytes, in hexadecimal; empty of a log that is no file.
    pub sha256: String,
    /// [s] time of the first of them.
    pub from_s: f64,
    /// [s] time of the last of them.
    pub to_s: f64,
}

/// What a step did to the error, in the unit of its measure.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorFall {
    /// What the error is, with its unit.
    #[cfg_attr(test, schemars(with = "String"))]
    pub measure: Measure,
    /// What sensor noise alone would leave.
    pub noise_floor: f64,
    /// On the training logs before the step.
    pub train_before: f64,
    /// On the training logs after it.
    pub train_after: f64,
    /// On held-out data before the step.
    pub validate_before: f64,
    /// On held-out data after it.
    pub validate_after: f64,
}

/// One step of the ladder.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelStep {
    /// Ids of the effects added; empty: only parameters were refitted.
    pub added: Vec<String>,
    /// Training logs.
    pub logs: Vec<LogReference>,
    /// Validation logs; empty: blocks of the training logs were held out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validation: Vec<LogReference>,
    /// The error before and after.
    pub error: ErrorFall,
    /// Every parameter before the step, by name: what stepping back restores.
    pub before: BTreeMap<String, f64>,
    /// The standard errors of those that had been fitted.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub standard_errors_before: BTreeMap<String, f64>,
}

/// A number of the base before and after a step, in its SI unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Name in the model file.
    pub name: String,
    /// Before.
    pub from: f64,
    /// After.
    pub to: f64,
    /// Of `to`; `None`: not fitted.
    pub standard_error: Option<f64>,
}
