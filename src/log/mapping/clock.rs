//! Where the time of a foreign log comes from.

use serde::{Deserialize, Serialize};

use crate::log::thresholds::THRESHOLDS;

/// Where time comes from: a column, or a fixed period.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeConfig {
    /// Name of the column.
    #[serde(default)]
    pub column: Option<String>,
    /// Unit of the column.
    #[serde(default = "second")]
    pub unit: String,
    /// [s] time from row to row, where no column holds it.
    #[serde(default)]
    pub period_s: Option<f64>,
    /// Instead of either: each row is a level at which the rotor had settled, as a thrust stand's table of averages, and nobody
    /// recorded the pauses between them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub levels: bool,
}

impl TimeConfig {
    /// [s] from row to row, where no column holds it.
    pub(crate) fn period(&self) -> Option<f64> {
        self.period_s.or(self.levels.then_some(THRESHOLDS.level_period))
    }

    /// Says what is wrong with it.
    pub(super) fn check(&self) -> Result<(), String> {
        match (&self.column, self.period_s, self.levels) {
            (Some(_), None, false) | (None, None, true) => Ok(()),
            (None, Some(period), false) if period.is_finite() && period > 0.0 => Ok(()),
            (None, Some(period), false) => Err(format!("time: period_s = {period} is not a time")),
            _ => Err("time: give one of `column`, `period_s` and `levels`".to_owned()),
        }
    }
}

pub(super) fn second() -> String {
    "s".to_owned()
}
