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
        "{path}: {reason} column `{column}` (for `{signal}` of the mapping `{mapping}`); the header reads {header}"
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
    use super::*;

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
