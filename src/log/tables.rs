//! What a file of another program holds before anybody says what it means: tables of named columns, each with a clock of its
//! own. A format's reader makes them; a mapping makes a log of them.

use serde::Serialize;

/// A table: rows with one clock. A file of rows is one table; a file of topics or messages is one for each of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name of the topic or message; empty where the file is one table.
    pub name: String,
    /// [s] stamp of each row, as the file has it: it need not rise, and is not-a-number where the row has none. Empty where
    /// the format does not say which column is the time: the mapping does.
    pub time: Vec<f64>,
    /// Line of the file on which each row stands; empty where the file is no text.
    pub lines: Vec<u64>,
    /// The columns, in the file's order; each as long as `time`, where that is not empty.
    pub columns: Vec<Column>,
}

impl Table {
    /// A table without columns yet, of a file that is no text.
    #[must_use]
    pub fn new(name: impl Into<String>, time: Vec<f64>) -> Self {
        Self { name: name.into(), time, lines: Vec::new(), columns: Vec::new() }
    }

    /// Where a row is: its line, or its number from 1.
    #[must_use]
    pub fn place(&self, row: usize) -> u64 {
        self.lines.get(row).copied().unwrap_or(row as u64 + 1)
    }

    /// Name by which a mapping finds a column.
    #[must_use]
    pub fn full_name(&self, column: &Column) -> String {
        if self.name.is_empty() { column.name.clone() } else { format!("{}.{}", self.name, column.name) }
    }
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name in the file, an index included: `motor[0]`.
    pub name: String,
    /// Unit of the values as [`crate::unit::Unit`] spells it; `None` where the file does not say.
    pub unit: Option<&'static str>,
    /// The values; not-a-number where the row has none.
    pub values: Vec<f64>,
}

/// Bytes or rows of a file that its reader left out.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// What it was: a code of small letters, of which `report` makes a sentence.
    pub code: &'static str,
    /// Which field, topic or message; empty where it is about none.
    pub subject: String,
    /// How many.
    pub count: u64,
    /// Where the first is, in bytes from the file's start.
    pub first_byte: u64,
}

impl Skipped {
    /// Counts something that was left out at `byte` of the file.
    pub(crate) fn count(all: &mut Vec<Self>, code: &'static str, subject: &str, byte: u64) {
        match all.iter_mut().find(|it| it.code == code && it.subject == subject) {
            Some(known) => known.count += 1,
            None => all.push(Self { code, subject: subject.to_owned(), count: 1, first_byte: byte }),
        }
    }
}

/// What a reader made of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tables {
    /// The tables, in the order in which the file first names them.
    pub tables: Vec<Table>,
    /// What was left out.
    pub skipped: Vec<Skipped>,
    /// Which log of the file this is, from 1, and of how many.
    pub part: Option<(usize, usize)>,
    /// What the file says of itself that a reader of the answer may need: firmware, craft, date. Keys as in the file.
    pub about: Vec<(String, String)>,
}

impl Tables {
    /// Counts something that was left out at `byte` of the file.
    pub fn skip(&mut self, code: &'static str, subject: &str, byte: u64) {
        Skipped::count(&mut self.skipped, code, subject, byte);
    }
}
