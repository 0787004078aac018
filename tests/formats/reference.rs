//! What a reference reader made of a log.

use std::fs;
use std::path::Path;

use serde::Deserialize;

/// A column; `None` is not-a-number.
#[derive(Deserialize)]
pub struct RefColumn {
    pub name: String,
    /// Empty where the values have none; `None` where the reference reader does not say.
    #[serde(default)]
    pub unit: Option<String>,
    pub values: Vec<Option<f64>>,
}

/// A table.
#[derive(Deserialize)]
pub struct RefTable {
    pub name: String,
    pub time: Vec<Option<f64>>,
    pub columns: Vec<RefColumn>,
}

/// Tables, or the frames of a bus capture.
#[derive(Deserialize)]
#[serde(untagged)]
pub enum Reference {
    Tables {
        /// Which log of the file.
        #[serde(default)]
        part: Option<usize>,
        tables: Vec<RefTable>,
    },
}

impl Reference {
    pub fn load(path: &Path) -> Self {
        let text = fs::read_to_string(path).expect("a reference");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// Which log of the file it is about.
    pub fn part(&self) -> Option<usize> {
        let Self::Tables { part, .. } = self;
        *part
    }
}
