//! What the columns of foreign logs mean: guessed, and confirmed.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::log::Mapping;
use crate::log::guess::GuessedColumn;
use crate::log::mapping::{MappingConfig, SHIPPED};
use crate::log::mended::{conversions, is_in};
use crate::session::{GuessedLog, SessionError};

/// A guess, and what somebody has made of it.
#[derive(Debug, Clone)]
pub(super) struct Guess {
    pub now: GuessedLog,
    /// The columns as they were guessed.
    first: Vec<GuessedColumn>,
}

/// What the columns of a log mean, confirmed by somebody.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeskMapping {
    /// As a command names it: a file, or a mapping that is shipped.
    pub name: String,
    /// Text of the file; none of a shipped one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
}

impl DeskMapping {
    /// Whether it is one that the program brings.
    pub fn is_shipped(&self) -> bool {
        SHIPPED.iter().any(|(name, _)| *name == self.name)
    }

    /// The mapping itself.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn load(&self) -> Result<Mapping, SessionError> {
        Ok(match &self.text {
            Some(text) => Mapping::parse(text, Path::new(&self.name))?,
            None => Mapping::load(&self.name)?,
        })
    }
}

/// Whether one mapping reads every file as the other one does: in whatever order they say the signals.
pub(super) fn reads_like(one: &Mapping, other: &Mapping) -> bool {
    let plain = |it: &Mapping| {
        let mut config = MappingConfig { description: String::new(), ..it.config.clone() };
        config.signal.sort_by(|a, b| a.name.cmp(&b.name));
        config
    };
    plain(one) == plain(other)
}

impl Guess {
    pub fn new(guessed: GuessedLog) -> Self {
        Self { first: guessed.columns.clone(), now: guessed }
    }

    /// What was mended, as `--column` says it.
    pub fn mended(&self) -> Vec<String> {
        let pairs = self.now.columns.iter().zip(&self.first);
        let other = pairs.filter(|(now, first)| now != first).map(|(now, _)| {
            let signal = if now.certainty.is_read() { now.signal.as_str() } else { "-" };
            let unit = unit_of(now).map_or(String::new(), |unit| format!(":{unit}"));
            format!("{}={signal}{unit}", now.column)
        });
        other.collect()
    }
}

/// The word by which a column's unit is said; none of one that is carried along.
pub(super) fn unit_of(column: &GuessedColumn) -> Option<&'static str> {
    conversions(&column.signal).into_iter().find(|it| is_in(column, it)).map(|it| it.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mappings_that_say_the_same_in_another_order_read_alike() {
        let signal = |name: &str, column: &str| {
            format!("[[signal]]\nname = \"{name}\"\ncolumn = \"{column}\"\nunit = \"rad/s\"\n")
        };
        let mapping = |description: &str, signals: [String; 2]| {
            let text = format!(
                "description = \"{description}\"\n[time]\ncolumn = \"t\"\nunit = \"s\"\n{}",
                signals.concat()
            );
            Mapping::parse(&text, Path::new("m.toml")).expect("a mapping")
        };
        let [left, right] = [1, 2].map(|rotor| format!("propeller_rate_{rotor}_rad_s"));
        let (left_spin, right_spin) = (signal(&left, "Left"), signal(&right, "Right"));
        let one = mapping("one.csv", [left_spin.clone(), right_spin.clone()]);
        assert!(reads_like(&one, &mapping("two.csv", [right_spin, left_spin])));
        let crossed = mapping("one.csv", [signal(&left, "Right"), signal(&right, "Left")]);
        assert!(!reads_like(&one, &crossed));
    }
}
