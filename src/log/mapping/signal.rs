//! One signal of a mapping, the columns that it comes from, and what becomes of several.

use serde::{Deserialize, Serialize};

use crate::log::signals::{LOG_SIGNALS, log_signal};
use crate::signal::columns;
use crate::unit::{Unit, UnitError};

/// What becomes of several columns.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Combine {
    /// All added, each times its weight if there are weights.
    Sum,
    /// The first less the others.
    Difference,
    /// Their mean.
    Mean,
}

/// One signal of our log and what it comes from: `(cell * scale + offset)` in `unit`, then SI.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalMapping {
    /// Name in our log: one of the log format, or any other of small letters, digits and `_`, which is carried along.
    pub name: String,
    /// Name of the column; `TABLE.COLUMN` in a file of several tables.
    #[serde(default)]
    pub column: Option<String>,
    /// Names of several columns, instead of one; a row counts where all of them have a value.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<String>,
    /// What becomes of several.
    #[serde(default)]
    pub combine: Option<Combine>,
    /// Factors of the columns of a sum, one for each; 1 if left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<f64>,
    /// Whether it is the change of the column a second, from the row before to the row behind: a rate of a body whose angle alone was
    /// measured. No value next to a hole in time.
    #[serde(default, skip_serializing_if = "is_not")]
    pub slope: bool,
    /// Column with the time of these values, where they have another clock than the rest of the file; in the unit of `[time]`.
    #[serde(default)]
    pub time_column: Option<String>,
    /// Unit of the scaled value; needed for every signal of the log format, meaningless for others.
    #[serde(default)]
    pub unit: Option<String>,
    /// Factor, 1 if left out.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
    /// Added after the factor, in `unit`; 0 if left out.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub offset: f64,
    /// Values outside are cut to this range (in SI), and counted.
    #[serde(default)]
    pub clamp: Option<[f64; 2]>,
    /// Values outside this range (in SI) are no measurement: the cell counts as missing.
    #[serde(default)]
    pub valid: Option<[f64; 2]>,
    /// Rows of the file by which the column is written late: each value belongs to the row so many rows above its own.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rows_later: usize,
    /// Whether the column may be absent.
    #[serde(default, skip_serializing_if = "is_not")]
    pub optional: bool,
    /// Whether it is read in place of those of the same name above it, where their columns are absent or read nothing but 0.
    #[serde(default, skip_serializing_if = "is_not")]
    pub instead: bool,
}

// What has its default is not written.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
pub(super) fn is_not(value: &bool) -> bool {
    !value
}

pub(super) fn is_zero(value: &usize) -> bool {
    *value == 0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn is_nothing(value: &f64) -> bool {
    *value == 0.0
}

fn one() -> f64 {
    1.0
}

impl SignalMapping {
    /// The columns it comes from.
    pub(crate) fn columns(&self) -> Vec<&str> {
        self.column.iter().chain(&self.columns).map(String::as_str).collect()
    }

    /// The value of a row, of the numbers in its columns.
    pub(crate) fn combined(&self, numbers: impl Iterator<Item = f64>) -> f64 {
        if !self.weights.is_empty() {
            return numbers.zip(&self.weights).map(|(number, weight)| number * weight).sum();
        }
        let mut numbers = numbers;
        let first = numbers.next().unwrap_or(f64::NAN);
        match self.combine {
            None => first,
            Some(Combine::Sum) => numbers.fold(first, |sum, number| sum + number),
            Some(Combine::Difference) => numbers.fold(first, |left, number| left - number),
            Some(Combine::Mean) => {
                let (sum, count) = numbers.fold((first, 1.0), |(sum, count), it| (sum + it, count + 1.0));
                sum / count
            }
        }
    }

    /// Whether what it says of its columns can be meant.
    fn check_columns(&self) -> Result<(), String> {
        let weights = &self.weights;
        if !weights.is_empty() && (self.combine != Some(Combine::Sum) || weights.len() != self.columns.len())
        {
            return Err("`weights` are of a `combine = \"sum\"`, one for each of its `columns`".to_owned());
        }
        if weights.iter().any(|weight| !weight.is_finite() || *weight == 0.0) {
            return Err("`weights` are numbers other than 0".to_owned());
        }
        match (&self.column, self.columns.len(), self.combine) {
            (Some(_), 0, None) => Ok(()),
            (None, 2.., Some(_)) => Ok(()),
            (None, 2.., None) => {
                Err("`combine` is missing: sum, difference or mean of its `columns`".to_owned())
            }
            (None, 1, _) => Err("`columns` wants two or more; one is a `column`".to_owned()),
            (Some(_), 0, Some(_)) => Err("`combine` wants `columns`, not a `column`".to_owned()),
            (Some(_), ..) => Err("give either `column` or `columns`".to_owned()),
            (None, 0, _) => Err("give its `column`".to_owned()),
        }
    }

    /// The unit to convert from, or what is wrong; `before` are the signals mapped already.
    pub(in crate::log) fn check(&self, before: &[Self]) -> Result<Option<Unit>, String> {
        if self.name == columns::TIME {
            return Err("time has a table of its own, [time]".to_owned());
        }
        match (before.iter().any(|other| other.name == self.name), self.instead) {
            (true, false) => {
                return Err(
                    "it is mapped twice; of several columns the second has `instead = true`".to_owned()
                );
            }
            (false, true) => return Err("`instead` wants a signal of the same name above it".to_owned()),
            _ => {}
        }
        let plain = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_';
        if self.name.is_empty() || !self.name.chars().all(plain) {
            return Err("names are of small letters, digits and `_`".to_owned());
        }
        self.check_columns()?;
        if !(self.scale.is_finite() && self.offset.is_finite() && self.scale != 0.0) {
            return Err(format!("scale = {}, offset = {} is no conversion", self.scale, self.offset));
        }
        for (key, range) in [("clamp", self.clamp), ("valid", self.valid)] {
            if range.is_some_and(|[low, high]| low.is_nan() || high.is_nan() || low >= high) {
                return Err(format!("`{key}` must go from low to high"));
            }
        }
        match (log_signal(&self.name), &self.unit) {
            (Some(known), Some(unit)) => {
                Unit::parse(unit, known.unit).map(Some).map_err(|error: UnitError| error.to_string())
            }
            (Some(known), None) => Err(format!("its unit is missing: say which unit becomes {}", known.unit)),
            (None, Some(_)) => {
                let names: Vec<&str> = LOG_SIGNALS[1..].iter().map(|known| known.name).collect();
                Err(format!(
                    "no signal of the log format has this name ({}); a channel of your own that is only carried along has no \
                     `unit`, use `scale`",
                    names.join(", ")
                ))
            }
            (None, None) => Ok(None),
        }
    }
}
