//! The mapping file: what the columns of a foreign log mean.

mod clock;
mod error;
mod shipped;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::file::{read_settings_text, toml_error};
use crate::unit::{Unit, UnitError};

use super::row_filter::RowFilter;
use super::signals::{LOG_SIGNALS, log_signal};
use super::thresholds::THRESHOLDS;
use crate::signal::columns;

pub use clock::TimeConfig;
pub use error::MappingError;
pub use shipped::SHIPPED;

/// A mapping file, as people write it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappingConfig {
    /// What it reads.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// Character between cells.
    #[serde(default = "comma")]
    pub delimiter: char,
    /// Lines that start with this character are remarks.
    #[serde(default)]
    pub comment: Option<char>,
    /// Lines above the header.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub skip_lines: usize,
    /// Whether a header line names the columns; without one they are named `#1`, `#2`, ...
    #[serde(default = "yes")]
    pub header: bool,
    /// Text encoding by its WHATWG name, such as `windows-1252`.
    #[serde(default = "utf_8")]
    pub encoding: String,
    /// Numbers are written 1,5 instead of 1.5.
    #[serde(default, skip_serializing_if = "is_not")]
    pub decimal_comma: bool,
    /// Cells that mean "no value", beside empty ones and `nan`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// Where time comes from; left out for files whose tables have clocks of their own.
    #[serde(default)]
    pub time: Option<TimeConfig>,
    /// Which rows count: `COLUMN == NUMBER` (or !=, <, <=, >, >=); all, if left out.
    #[serde(default, rename = "where")]
    pub condition: Option<String>,
    /// The columns that are wanted.
    pub signal: Vec<SignalMapping>,
}

/// What becomes of several columns.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Combine {
    /// All added.
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
}

// What has its default is not written.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_not(value: &bool) -> bool {
    !value
}

fn is_zero(value: &usize) -> bool {
    *value == 0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

fn is_nothing(value: &f64) -> bool {
    *value == 0.0
}

fn comma() -> char {
    ','
}

fn yes() -> bool {
    true
}

fn utf_8() -> String {
    "utf-8".to_owned()
}

fn one() -> f64 {
    1.0
}

/// A mapping that has been checked.
#[derive(Debug, Clone)]
pub struct Mapping {
    /// Its file, or its name.
    pub(crate) name: String,
    pub(crate) config: MappingConfig,
    pub(crate) encoding: &'static encoding_rs::Encoding,
    /// Which rows count.
    pub(crate) filter: Option<RowFilter>,
    /// Unit of time, and of each signal of the log format.
    pub(crate) time_unit: Unit,
    pub(crate) units: Vec<Option<Unit>>,
}

impl Mapping {
    /// The shipped mapping of that name, else the file.
    ///
    /// # Errors
    /// [`MappingError`] with the place.
    pub fn load(name: &str) -> Result<Self, MappingError> {
        if let Some((name, text)) = SHIPPED.iter().find(|(shipped, _)| *shipped == name) {
            return Self::parse(text, Path::new(name));
        }
        let path = Path::new(name);
        match read_settings_text(path) {
            Ok(text) => Self::parse(&text, path),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                Err(MappingError::Unknown { name: name.to_owned() })
            }
            Err(source) => Err(MappingError::File { path: path.to_owned(), source }),
        }
    }

    /// Name of a shipped mapping whose columns are all among `names`, and that takes none otherwise than `guessed`, what was
    /// guessed of them: a command in DShot is none in microseconds.
    #[must_use]
    pub fn shipped_for(names: &[&str], guessed: &[SignalMapping]) -> Option<&'static str> {
        let agrees = |signal: &SignalMapping| {
            let mut same = guessed.iter().filter(|it| it.name == signal.name && it.unit == signal.unit);
            // A guess of a scale is a round number; two scales that are meant to differ do so by far more.
            same.all(|it| (it.scale / signal.scale - 1.0).abs() < THRESHOLDS.same_scale)
        };
        let fits = |text: &str| {
            let Ok(config) = toml::from_str::<MappingConfig>(text) else { return false };
            let time = config.time.iter().filter_map(|time| time.column.as_deref());
            let needed = config.signal.iter().filter(|it| !it.optional).flat_map(SignalMapping::columns);
            time.chain(needed).all(|column| names.contains(&column)) && config.signal.iter().all(agrees)
        };
        SHIPPED.iter().find(|(_, text)| fits(text)).map(|(name, _)| *name)
    }

    /// The mapping of a table whose columns have our names and units: each is taken as it is, `time_s` as the time.
    #[must_use]
    pub fn ours<'a>(columns: impl Iterator<Item = &'a str>) -> Self {
        let signals = columns.filter(|name| *name != columns::TIME).map(|name| SignalMapping {
            name: name.to_owned(),
            column: Some(name.to_owned()),
            columns: Vec::new(),
            combine: None,
            time_column: None,
            unit: None,
            scale: 1.0,
            offset: 0.0,
            clamp: None,
            valid: None,
            rows_later: 0,
            optional: false,
        });
        let time = TimeConfig {
            column: Some(columns::TIME.to_owned()),
            unit: clock::second(),
            period_s: None,
            levels: false,
        };
        let config = MappingConfig::new(Some(time), signals.collect());
        let units = vec![None; config.signal.len()];
        let time_unit = Unit { name: "s", si: "s", scale: 1.0, offset: 0.0 };
        Self {
            name: "of our own names".to_owned(),
            config,
            encoding: encoding_rs::UTF_8,
            filter: None,
            time_unit,
            units,
        }
    }

    /// The columns that it needs.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        let time = self.config.time.iter().filter_map(|time| time.column.as_deref());
        let needed = self.config.signal.iter().filter(|it| !it.optional).flat_map(SignalMapping::columns);
        time.chain(needed)
    }

    /// Whether it looks at the column of a table.
    #[must_use]
    pub fn wants(&self, table: &str, column: &str) -> bool {
        let is = |wanted: &str| {
            wanted == column
                || wanted
                    .strip_suffix(column)
                    .and_then(|rest| rest.strip_suffix('.'))
                    .is_some_and(|rest| table == rest || table.ends_with(rest))
        };
        let is_time = self.config.time.as_ref().and_then(|time| time.column.as_deref()).is_some_and(is);
        let is_condition = self.filter.as_ref().is_some_and(|filter| is(&filter.column));
        let is_all = self.config.signal.is_empty();
        is_all
            || is_time
            || is_condition
            || self.config.signal.iter().flat_map(SignalMapping::columns).any(is)
    }

    /// The mapping in `text`; `path` is for messages.
    ///
    /// # Errors
    /// [`MappingError`] with the place.
    pub fn parse(text: &str, path: &Path) -> Result<Self, MappingError> {
        let config: MappingConfig = toml::from_str(text).map_err(|error| MappingError::Syntax {
            path: path.to_owned(),
            message: toml_error(text, &error),
        })?;
        config.build(path)
    }
}

impl MappingConfig {
    /// A mapping of a plain CSV: commas between cells, a header, UTF-8.
    #[must_use]
    pub fn new(time: Option<TimeConfig>, signal: Vec<SignalMapping>) -> Self {
        Self {
            description: String::new(),
            delimiter: comma(),
            comment: None,
            skip_lines: 0,
            header: true,
            encoding: utf_8(),
            decimal_comma: false,
            missing: Vec::new(),
            time,
            condition: None,
            signal,
        }
    }

    /// Checks everything that can be checked without a log.
    ///
    /// # Errors
    /// [`MappingError`]; `path` is for messages.
    pub fn build(self, path: &Path) -> Result<Mapping, MappingError> {
        let setting = |reason: String| MappingError::Setting { path: path.to_owned(), reason };
        let encoding = encoding_rs::Encoding::for_label(self.encoding.as_bytes())
            .ok_or_else(|| setting(format!("there is no text encoding `{}`", self.encoding)))?;
        if !self.delimiter.is_ascii() || self.comment.is_some_and(|comment| !comment.is_ascii()) {
            return Err(setting("`delimiter` and `comment` must be ASCII characters".to_owned()));
        }
        if self.decimal_comma && self.delimiter == ',' {
            return Err(setting("with `decimal_comma` the delimiter cannot be a comma too".to_owned()));
        }
        self.time.as_ref().map_or(Ok(()), TimeConfig::check).map_err(setting)?;
        let unit_of_time = self.time.as_ref().map_or("s", |time| time.unit.as_str());
        let time_unit = Unit::parse(unit_of_time, "s").map_err(|error| setting(format!("time: {error}")))?;
        let filter = self.condition.as_deref().map(RowFilter::parse).transpose().map_err(setting)?;
        let mut units = Vec::new();
        for (index, signal) in self.signal.iter().enumerate() {
            let unit = signal.check(&self.signal[..index]).map_err(|reason| MappingError::Signal {
                path: path.to_owned(),
                signal: signal.name.clone(),
                reason,
            })?;
            units.push(unit);
        }
        Ok(Mapping { name: path.display().to_string(), config: self, encoding, filter, time_unit, units })
    }
}

impl SignalMapping {
    /// The columns it comes from.
    pub(crate) fn columns(&self) -> Vec<&str> {
        self.column.iter().chain(&self.columns).map(String::as_str).collect()
    }

    /// The value of a row, of the numbers in its columns.
    pub(crate) fn combined(&self, mut numbers: impl Iterator<Item = f64>) -> f64 {
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
    pub(super) fn check(&self, before: &[Self]) -> Result<Option<Unit>, String> {
        if self.name == columns::TIME {
            return Err("time has a table of its own, [time]".to_owned());
        }
        if before.iter().any(|other| other.name == self.name) {
            return Err("it is mapped twice".to_owned());
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

#[cfg(test)]
mod tests;
