//! What a check found: a code, what it was found in, how many rows it concerns, and the numbers it rests on. Sentences are
//! made of it in `report`, and nowhere else.

use std::fmt;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// One finding of a check, or one caveat of an answer.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What was found, by the glossary's word in snake case; stable, for scripts and tests.
    pub code: &'static str,
    /// Name of the log it was found in; empty where it is of all of them, or of one that is known.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub log: String,
    /// What it was found in: a channel, a rotor, a parameter, a block; empty for all of them.
    pub subject: String,
    /// Whether the subject is one rotor of the log: it is said beside the log's name.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub(crate) is_of_rotor: bool,
    /// Rows concerned; 0 where no rows are meant.
    pub rows: usize,
    /// What it rests on, each value under its name; a unit is part of the name.
    #[serde(serialize_with = "as_map")]
    #[cfg_attr(test, schemars(with = "std::collections::BTreeMap<String, Evidence>"))]
    pub evidence: Vec<(&'static str, Evidence)>,
}

/// One value that a finding rests on.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Evidence {
    /// A count.
    Count(usize),
    /// A number, in the unit that its name carries.
    Number(f64),
    /// A name or a quotation from the log, never a sentence.
    Text(String),
    /// Several numbers.
    Numbers(Vec<f64>),
    /// Several names.
    Texts(Vec<String>),
    /// Another finding that this one follows from.
    Cause(Box<Finding>),
}

impl Finding {
    /// A finding without rows and evidence.
    #[must_use]
    pub fn new(code: &'static str, subject: impl Into<String>) -> Self {
        let (log, subject) = (String::new(), subject.into());
        Self { code, log, subject, is_of_rotor: false, rows: 0, evidence: Vec::new() }
    }

    /// A finding about one rotor, by the number of its columns.
    #[must_use]
    pub fn of_rotor(code: &'static str, number: usize) -> Self {
        Self { is_of_rotor: true, ..Self::new(code, format!("rotor {number}")) }
    }

    /// In the log of this name.
    #[must_use]
    pub fn of(mut self, log: &str) -> Self {
        log.clone_into(&mut self.log);
        self
    }

    /// Its log, and the rotor that it is about.
    #[must_use]
    pub fn place(&self) -> String {
        match (self.log.is_empty(), self.is_of_rotor) {
            (true, true) => self.subject.clone(),
            (false, true) => format!("{}, {}", self.log, self.subject),
            (_, false) => self.log.clone(),
        }
    }

    /// With the number of rows concerned.
    #[must_use]
    pub fn rows(mut self, rows: usize) -> Self {
        self.rows = rows;
        self
    }

    /// With one more value.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl Into<Evidence>) -> Self {
        self.evidence.push((name, value.into()));
        self
    }

    /// With the finding that it follows from.
    #[must_use]
    pub fn because(mut self, cause: Self) -> Self {
        self.evidence.push(("because", Evidence::Cause(Box::new(cause))));
        self
    }

    /// The finding that it follows from.
    #[must_use]
    pub fn cause(&self) -> Option<&Self> {
        match self.get("because") {
            Some(Evidence::Cause(cause)) => Some(cause),
            _ => None,
        }
    }

    /// The value under `name`.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Evidence> {
        self.evidence.iter().find(|(own, _)| *own == name).map(|(_, value)| value)
    }

    /// The number or count under `name`; NaN where there is none.
    #[must_use]
    pub fn number(&self, name: &str) -> f64 {
        match self.get(name) {
            Some(Evidence::Number(value)) => *value,
            Some(Evidence::Count(count)) => *count as f64,
            _ => f64::NAN,
        }
    }

    /// The count under `name`; 0 where there is none.
    #[must_use]
    pub fn count(&self, name: &str) -> usize {
        match self.get(name) {
            Some(Evidence::Count(count)) => *count,
            _ => 0,
        }
    }

    /// The numbers under `name`; none where there are none.
    #[must_use]
    pub fn numbers(&self, name: &str) -> &[f64] {
        match self.get(name) {
            Some(Evidence::Numbers(numbers)) => numbers,
            _ => &[],
        }
    }

    /// The names under `name`; none where there are none.
    #[must_use]
    pub fn texts(&self, name: &str) -> &[String] {
        match self.get(name) {
            Some(Evidence::Texts(texts)) => texts,
            _ => &[],
        }
    }

    /// The text under `name`; empty where there is none.
    #[must_use]
    pub fn text(&self, name: &str) -> &str {
        match self.get(name) {
            Some(Evidence::Text(text)) => text,
            _ => "",
        }
    }
}

fn as_map<S: Serializer>(evidence: &[(&'static str, Evidence)], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(evidence.len()))?;
    for (name, value) in evidence {
        map.serialize_entry(name, value)?;
    }
    map.end()
}

/// For logs of the program and messages of errors; people read `report`'s sentence.
impl fmt::Display for Finding {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.log.is_empty() {
            write!(out, "{}: ", self.log)?;
        }
        write!(out, "{} {}", self.code, self.subject)?;
        for (name, value) in &self.evidence {
            write!(out, ", {name} = {value}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => write!(out, "{count}"),
            Self::Number(number) => write!(out, "{number}"),
            Self::Text(text) => out.write_str(text),
            Self::Numbers(numbers) => write!(out, "{numbers:?}"),
            Self::Texts(texts) => out.write_str(&texts.join(" ")),
            Self::Cause(cause) => write!(out, "{cause}"),
        }
    }
}

impl From<usize> for Evidence {
    fn from(count: usize) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for Evidence {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<&str> for Evidence {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Evidence {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<Vec<f64>> for Evidence {
    fn from(numbers: Vec<f64>) -> Self {
        Self::Numbers(numbers)
    }
}

impl From<Vec<String>> for Evidence {
    fn from(texts: Vec<String>) -> Self {
        Self::Texts(texts)
    }
}
