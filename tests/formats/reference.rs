//! What a reference reader made of a log.

use std::fs;
use std::path::Path;

use serde::Deserialize;

/// A number as JSON can hold it.
#[derive(Deserialize)]
#[serde(untagged)]
pub enum Cell {
    Number(f64),
    /// `nan`, `inf` or `-inf`.
    Word(String),
    /// No value.
    None(()),
}

impl Cell {
    pub fn value(&self) -> f64 {
        match self {
            Self::Number(number) => *number,
            Self::Word(word) => word.parse().expect("a number in a word"),
            Self::None(()) => f64::NAN,
        }
    }
}

/// A column.
#[derive(Deserialize)]
pub struct RefColumn {
    pub name: String,
    /// Empty where the values have none; `None` where the reference reader does not say.
    #[serde(default)]
    pub unit: Option<String>,
    pub values: Vec<Cell>,
}

/// A table.
#[derive(Deserialize)]
pub struct RefTable {
    pub name: String,
    pub time: Vec<Cell>,
    pub columns: Vec<RefColumn>,
}

/// A frame of a bus: [s] stamp, channel, identifier, flags as letters, length, data in hexadecimal.
pub type RefFrame = (f64, u32, u32, String, u8, String);

/// What it made of one: tables, or the frames of a bus.
#[derive(Deserialize)]
#[serde(untagged)]
pub enum Reference {
    Tables {
        /// Which log of the file.
        #[serde(default)]
        part: Option<usize>,
        tables: Vec<RefTable>,
    },
    Frames {
        frames: Vec<RefFrame>,
    },
}

impl Reference {
    pub fn load(path: &Path) -> Self {
        let text = fs::read_to_string(path).expect("a reference");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// Which log of the file it is about.
    pub fn part(&self) -> Option<usize> {
        match self {
            Self::Tables { part, .. } => *part,
            Self::Frames { .. } => None,
        }
    }
}
