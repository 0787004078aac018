//! Why a foreign log cannot be read.

use std::path::PathBuf;

use super::dataset::{DatasetError, nanoseconds};

/// What to do about a cell that is no number.
fn instead_of(cell: &str) -> &'static str {
    if is_date(cell) {
        "stamps of date and time are not read: write seconds, or give the mapping a `period_s` (or, where each row is a level at rest, `levels = true`) in place of the column"
    } else {
        "if it means no value, name it in the mapping's `missing`"
    }
}

/// Whether a cell holds a date, as `2026-11-20 14:03:05`, or the time of a day, as `14:03:05.123`.
fn is_date(cell: &str) -> bool {
    let is_digit = |letter: char| letter.is_ascii_digit();
    let numbers = |mark: char| cell.split(mark).filter(|part| part.starts_with(is_digit)).count();
    cell.starts_with(is_digit) && ['-', '/', ':'].iter().any(|mark| numbers(*mark) >= 3)
}

/// What to do where another character stands between the cells.
fn asks_for(delimiter: char) -> String {
    let spelled = if delimiter == '\t' { "\\t".to_owned() } else { delimiter.to_string() };
    format!(
        "; its cells seem to be parted by `{spelled}`: write `delimiter = \"{spelled}\"` above `[time]` in the mapping"
    )
}

/// Why a foreign log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ForeignError {
    /// The file system said no.
    #[error("{path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The bytes are not text of that encoding, or the text is not CSV.
    #[error("{path}{}: {reason}", line.map_or_else(String::new, |line| format!(", line {line}")))]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: Option<u64>,
        /// What is wrong there.
        reason: String,
    },
    /// The mapping names a column that the file does not have, or has twice.
    #[error(
        "{path}: {reason} column `{column}` (for `{signal}` of the mapping `{mapping}`); the header reads {header}{}",
        delimiter.map_or_else(String::new, asks_for)
    )]
    Column {
        /// The file.
        path: PathBuf,
        /// Name of the column.
        column: String,
        /// The signal that needs it.
        signal: Box<str>,
        /// The mapping's file, or its name.
        mapping: Box<str>,
        /// `no` or `more than one`.
        reason: &'static str,
        /// The columns that are there.
        header: Box<str>,
        /// Another character than the mapping's that seems to stand between the cells.
        delimiter: Option<char>,
    },
    /// A cell is not a number.
    #[error("{path}, line {line}, column `{column}`: `{cell}` is not a number ({})", instead_of(cell))]
    Cell {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// What is there.
        cell: String,
    },
    /// Time begins anew inside the file.
    #[error(
        "{path}, line {line}: time goes back from {} s to {} s and goes on from there: {parts} logs in one \
         file; choose one with --part 1 to {parts}",
        nanoseconds(*before), nanoseconds(*after)
    )]
    Restart {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// [s]
        before: f64,
        /// [s]
        after: f64,
        /// How many logs the file holds.
        parts: usize,
    },
    /// A part that is not there.
    #[error("{path}: there is no part {part}; the file holds {parts}")]
    Part {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        part: usize,
        /// How many logs the file holds.
        parts: usize,
    },
    /// Text without a clock.
    #[error(
        "{path}: the file has no clock of its own, so the mapping needs `[time]` in its mapping: a `column` with its `unit`, a `period_s`, or `levels = true` where each row is a level at rest"
    )]
    NoClock {
        /// The file.
        path: PathBuf,
    },
    /// No row is left.
    #[error("{path}: no row holds a time and a value")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// What was read is no log.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::log::Mapping;
    use crate::log::mapped::parse;

    #[test]
    fn a_table_parted_by_another_character_asks_for_its_delimiter() {
        let mapping =
            "[time]\ncolumn = \"#1\"\n[[signal]]\nname = \"command_1\"\ncolumn = \"#2\"\nunit = \"-\"\n";
        let of = |text: &str, mapping: &str| {
            let mapping = Mapping::parse(mapping, Path::new("m.toml")).expect("a mapping");
            parse(text.as_bytes(), Path::new("a.txt"), &mapping, None).expect_err("no column").to_string()
        };
        let said = of("0\t1\n1\t2\n", &format!("header = false\n{mapping}"));
        assert!(
            said.contains("no column `#2`")
                && said.ends_with("write `delimiter = \"\\t\"` above `[time]` in the mapping"),
            "{said}"
        );
        let said = of("t;u\n0;1\n", mapping);
        assert!(said.contains("`delimiter = \";\"`"), "{said}");
        assert!(!of("t,u (a;b)\n0,1\n", mapping).contains("delimiter"));
    }

    #[test]
    fn a_stamp_of_date_or_time_is_known_as_one() {
        let said = |cell: &str| {
            let (path, column) = (PathBuf::from("a.csv"), "t".to_owned());
            ForeignError::Cell { path, line: 2, column, cell: cell.to_owned() }.to_string()
        };
        for stamp in ["2026-11-20 14:03:05.123", "20/11/2026", "14:03:05.123", "2026-11-20T14:03:05Z"] {
            assert!(said(stamp).contains("stamps of date and time are not read: write seconds"), "{stamp}");
        }
        for cell in ["off", "-1e-3-", "--:--:--", "1-2", "1.5.3"] {
            assert!(
                said(cell)
                    .ends_with("is not a number (if it means no value, name it in the mapping's `missing`)"),
                "{cell}"
            );
        }
    }
}
