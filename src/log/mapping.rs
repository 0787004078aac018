//! The mapping file: what the columns of a foreign log mean.

mod alternatives;
mod clock;
mod error;
mod shipped;
mod signal;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::file::{read_settings_text, toml_error};
use crate::unit::Unit;

use super::row_filter::RowFilter;
use crate::signal::columns;

pub use clock::TimeConfig;
pub use error::MappingError;
pub use shipped::SHIPPED;
pub use signal::{Combine, SignalMapping};
use signal::{is_not, is_zero};

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

fn comma() -> char {
    ','
}

fn yes() -> bool {
    true
}

fn utf_8() -> String {
    "utf-8".to_owned()
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
        let fits = |text: &str| {
            let Ok(config) = toml::from_str::<MappingConfig>(text) else { return false };
            let mut time = config.time.iter().filter_map(|time| time.column.as_deref());
            time.all(|column| names.contains(&column))
                && alternatives::fit(&config.signal, names)
                && guessed.iter().all(|it| alternatives::agree(&config.signal, it))
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
            weights: Vec::new(),
            slope: false,
            time_column: None,
            unit: None,
            scale: 1.0,
            offset: 0.0,
            clamp: None,
            valid: None,
            rows_later: 0,
            optional: false,
            instead: false,
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
        let needed = self.config.signal.iter().filter(|it| self.config.is_needed(it));
        time.chain(needed.flat_map(SignalMapping::columns))
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

    /// The signals of this name, in their order: the first, and those that are read instead.
    pub(crate) fn alternatives<'a>(
        &'a self,
        name: &'a str,
    ) -> impl Iterator<Item = (usize, &'a SignalMapping)> {
        alternatives::of_name(&self.signal, name)
    }

    /// Whether a file must have the columns of this signal.
    pub(crate) fn is_needed(&self, signal: &SignalMapping) -> bool {
        alternatives::is_needed(&self.signal, signal)
    }

    /// The signals of which a file must have one of several columns, each by its first.
    pub(crate) fn one_of_several(&self) -> impl Iterator<Item = &SignalMapping> {
        alternatives::one_of_several(&self.signal)
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
            if signal.slope && self.time.as_ref().is_some_and(|time| time.levels) {
                let reason = "`slope` wants a clock: the rows of `levels = true` have none".to_owned();
                return Err(MappingError::Signal {
                    path: path.to_owned(),
                    signal: signal.name.clone(),
                    reason,
                });
            }
            units.push(unit);
        }
        Ok(Mapping { name: path.display().to_string(), config: self, encoding, filter, time_unit, units })
    }
}

#[cfg(test)]
mod tests;
