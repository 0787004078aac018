//! The ladder: what was added to a model, from which log, and what it did to the error.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::Model;

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

/// What an error is of, as model files and answers write it: the quantity, how the model was run, and the unit in brackets
/// at the end.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(inline))]
#[serde(transparent)]
pub struct Measure(String);

impl Measure {
    /// The rms of `channel` [`unit`] over free runs: between holes, or over windows of so many seconds, each from a fitted state.
    #[must_use]
    pub fn of_free_runs(channel: &str, windows_s: Option<f64>, unit: &str) -> Self {
        Self(match windows_s {
            None => format!("rms of {channel}, free run between holes [{unit}]"),
            Some(seconds) => {
                format!(
                    "rms of {channel}, free run over windows of {seconds} s, initial state fitted [{unit}]"
                )
            }
        })
    }

    /// The rms of `quantity` [`unit`].
    #[must_use]
    pub fn of(quantity: &str, unit: &str) -> Self {
        Self(format!("rms of {quantity} [{unit}]"))
    }

    /// The unit; empty where a file names none.
    #[must_use]
    pub fn unit(&self) -> &str {
        self.0.rsplit_once('[').map_or("", |(_, rest)| rest.trim_end_matches(']'))
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// What a step did to the error, in the unit of its measure.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorFall {
    /// What the error is, with its unit.
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
pub struct Step {
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

impl Model {
    /// Every parameter a fit may change, by name.
    #[must_use]
    pub fn parameters(&self) -> BTreeMap<String, f64> {
        let base = self.rotor_parameters().into_iter().chain(self.body_parameters()).map(str::to_owned);
        let effects = self
            .effects
            .iter()
            .flat_map(|added| added.parameters.keys().map(move |name| format!("{}.{name}", added.id)));
        base.chain(effects).filter_map(|name| self.parameter(&name).map(|value| (name, value))).collect()
    }

    /// The base's own numbers that the last step of the ladder changed.
    #[must_use]
    pub fn last_changes(&self) -> Vec<Change> {
        let Some(step) = self.ladder.last() else { return Vec::new() };
        let changed =
            step.before.iter().filter(|(name, _)| !name.contains('.')).filter_map(|(name, from)| {
                let to = self.parameter(name).filter(|to| to != from)?;
                let standard_error = self.standard_errors.get(name).copied();
                Some(Change { name: name.clone(), from: *from, to, standard_error })
            });
        changed.collect()
    }

    /// Undoes the last step of the ladder; `None` when there is none.
    #[must_use]
    pub fn step_back(&self) -> Option<Self> {
        let mut model = self.clone();
        let step = model.ladder.pop()?;
        model.effects.retain(|added| !step.added.contains(&added.id));
        // Of what the step did not move the errors stand, too; of what it added they go with it.
        let is_moved = |name: &str| match step.before.get(name) {
            Some(before) => self.parameter(name) != Some(*before),
            None => name.contains('.'),
        };
        model.standard_errors.retain(|name, _| !is_moved(name));
        model.standard_errors.extend(step.standard_errors_before);
        for (name, value) in &step.before {
            model.set_parameter(name, *value);
        }
        Some(model)
    }
}
