//! The CSV log format: a header of signal names with units, one line per sample, empty cells where a value is
//! missing. Foreign files go through `import`; this reader refuses what it would have to guess.

use std::fmt::Write as _;
use std::fs;
use std::io::{self, Read as _};
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::csv_blocks::{self, number};
use super::csv_header::{CsvHeader, plain_body, without_mark};
use super::csv_parts::{self, Parts};
use super::dataset::{Dataset, DatasetError};
use super::limits::{self, not_names, shortened};
use super::lines::Lines;
use crate::cancel;
use crate::file::{MappingPlace, write_atomically_with};
use crate::signal::columns;
use crate::threads;

/// Why a log file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file system said no.
    #[error("log {path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Not a CSV file of UTF-8 text.
    #[error("{path}, line {line}: {reason}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong there.
        reason: String,
    },
    /// The header is empty or lacks time.
    #[error(
        "{path}: the header has no column `time_s`; it reads `{header}`; `import {path}` shows what the columns of a foreign log may mean, and {place} says it"
    )]
    NoTime {
        /// The file.
        path: PathBuf,
        /// The header found.
        header: String,
        /// Where a mapping is named.
        place: MappingPlace,
    },
    /// A cell is not a number.
    #[error("{path}, line {line}, column `{column}`: `{cell}` is not a number")]
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
    /// A row does not say when it was.
    #[error(
        "{path}, line {line}: the cell of `time_s` is empty; every row needs its time (`import` leaves out rows without one, and says which)"
    )]
    RowWithoutTime {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
    },
    /// The cells are numbers, but no log.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}

/// SHA-256 of `bytes` in hexadecimal.
#[must_use]
pub fn content_hash(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(64), |mut text, byte| {
        // Writing to a `String` cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// SHA-256 of a file of any length, in hexadecimal.
///
/// # Errors
/// What the system says.
pub fn file_hash(path: &Path) -> io::Result<String> {
    let mut file = fs::File::open(path)?;
    let mut hash = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hexadecimal(&hash.finalize())),
            count => hash.update(block.get(..count).unwrap_or(&[])),
        }
    }
}

/// Reads a log.
///
/// # Errors
/// [`LogError`] with file, line and column.
pub fn read(path: &Path) -> Result<Dataset, LogError> {
    if let Some(Parts { header, digest, columns }) = csv_parts::read(path) {
        return dataset(header, hexadecimal(&digest), columns, path);
    }
    let bytes = limits::read(path).map_err(|source| LogError::File { path: path.to_owned(), source })?;
    parse(&bytes, path)
}

/// Parses the bytes of a log; `path` is for messages.
///
/// # Errors
/// [`LogError`] with file, line and column.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Dataset, LogError> {
    let text = without_mark(bytes);
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(text);
    let header: Vec<String> =
        reader.headers().map_err(|error| syntax(&error, path))?.iter().map(str::to_owned).collect();
    let Some(time_at) = header.iter().position(|name| name == columns::TIME) else {
        let (path, header) = (path.to_owned(), shortened_header(&header));
        return Err(LogError::NoTime { path, header, place: MappingPlace::default() });
    };
    if let Some(reason) = not_names(header.iter().map(String::as_str)) {
        return Err(LogError::Syntax { path: path.to_owned(), line: 1, reason });
    }
    let plain = || csv_blocks::columns(plain_body(text)?, header.len(), time_at);
    let all = NonZeroUsize::new(threads::most());
    let (hash, plain) = threads::both(|| content_hash(bytes), || threads::limited(all, plain));
    let columns = match plain {
        Some(columns) => columns,
        None => by_rows(reader, text, path, (&header, time_at))?,
    };
    dataset(CsvHeader { names: header, time_at }, hash, columns, path)
}

/// The log of these columns.
fn dataset(
    CsvHeader { names, time_at }: CsvHeader,
    hash: String,
    mut columns: Vec<Vec<f64>>,
    path: &Path,
) -> Result<Dataset, LogError> {
    let time = columns.get_mut(time_at).map(std::mem::take).unwrap_or_default();
    let mut log = Dataset::new(path.display().to_string(), hash, time)?;
    for (index, (name, values)) in names.into_iter().zip(columns).enumerate() {
        if index != time_at && !name.is_empty() {
            log.insert(name, values)?;
        }
    }
    Ok(log)
}

/// The columns of a text whose header was read, row by row.
fn by_rows(
    mut reader: csv::Reader<&[u8]>,
    text: &[u8],
    path: &Path,
    (header, time_at): (&[String], usize),
) -> Result<Vec<Vec<f64>>, LogError> {
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); header.len()];
    let mut lines = Lines::new(text, None, 1);
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(|error| syntax(&error, path))? {
        cancel::check();
        let line = lines.of(record.position());
        if record.len() > header.len() {
            let reason = format!("{} cells under a header of {}", record.len(), header.len());
            return Err(LogError::Syntax { path: path.to_owned(), line, reason });
        }
        for (index, (column, name)) in columns.iter_mut().zip(header).enumerate() {
            let cell = record.get(index).unwrap_or("");
            column.push(number(cell).ok_or_else(|| LogError::Cell {
                path: path.to_owned(),
                line,
                column: name.clone(),
                cell: shortened(cell),
            })?);
        }
        if columns[time_at].last().is_some_and(|time| time.is_nan()) {
            return Err(LogError::RowWithoutTime { path: path.to_owned(), line });
        }
    }
    Ok(columns)
}

/// What the `csv` crate says of a text.
fn syntax(error: &csv::Error, path: &Path) -> LogError {
    LogError::Syntax {
        path: path.to_owned(),
        line: error.position().map_or(1, csv::Position::line),
        reason: match error.kind() {
            csv::ErrorKind::Utf8 { .. } => "not UTF-8 text".to_owned(),
            _ => error.to_string(),
        },
    }
}

/// A header for a message: its first names.
fn shortened_header(header: &[String]) -> String {
    const SHOWN: usize = 24;
    let shown = header.iter().take(SHOWN).map(|name| shortened(name)).collect::<Vec<_>>().join(",");
    if header.len() > SHOWN { format!("{shown},...") } else { shown }
}

/// Rows of a log that are written at a time.
const ROWS_AT_A_TIME: usize = 4_096;

/// Emits a log as CSV text; each number in the shortest spelling that reads back the same.
#[must_use]
pub fn emit(log: &Dataset) -> String {
    let mut text = emit_header(log);
    text.push_str(&emit_rows(log, 0..log.len()));
    text
}

/// The first line of a log's text.
pub(crate) fn emit_header(log: &Dataset) -> String {
    let names = log.names().filter(|name| log.column(name).is_some());
    let mut text = std::iter::once(columns::TIME).chain(names).collect::<Vec<_>>().join(",");
    text.push('\n');
    text
}

/// The lines of these rows.
pub(crate) fn emit_rows(log: &Dataset, rows: Range<usize>) -> String {
    let columns: Vec<&[f64]> = log.names().filter_map(|name| log.column(name)).collect();
    let mut text = String::new();
    for row in rows {
        // Writing to a `String` cannot fail.
        let _ = write!(text, "{}", log.time()[row]);
        for column in &columns {
            text.push(',');
            if column[row].is_finite() {
                let _ = write!(text, "{}", column[row]);
            }
        }
        text.push('\n');
    }
    text
}

/// Rows of a long log, so many at a time: its text takes several times the memory of its numbers.
pub(crate) fn blocks(rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = rows.end;
    rows.step_by(ROWS_AT_A_TIME).map(move |from| from..(from + ROWS_AT_A_TIME).min(end))
}

/// Writes a log; the file appears complete or not at all.
///
/// # Errors
/// [`LogError::File`] when the system refuses.
pub fn write(log: &Dataset, path: &Path) -> Result<(), LogError> {
    let fill = |file: &mut dyn io::Write| {
        file.write_all(emit_header(log).as_bytes())?;
        blocks(0..log.len()).try_for_each(|rows| file.write_all(emit_rows(log, rows).as_bytes()))
    };
    write_atomically_with(path, fill).map_err(|source| LogError::File { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_text(text: &str) -> Result<Dataset, LogError> {
        parse(text.as_bytes(), Path::new("log.csv"))
    }

    #[test]
    fn reads_what_it_wrote() {
        let text = "time_s,command_1,propeller_rate_1_rad_s\n0,0.1,\n0.02,,617.25\n";
        let log = parse_text(text).expect("a good log");
        assert_eq!(emit(&log), text);
        assert_eq!(log.column("propeller_rate_1_rad_s").expect("there")[1], 617.25);
        assert_eq!(log.sha256().len(), 64);
    }

    /// Rows are written so many at a time, and none is lost between two of these.
    #[test]
    fn a_long_log_is_written_whole() {
        for count in [ROWS_AT_A_TIME, 2 * ROWS_AT_A_TIME + 1] {
            let time: Vec<f64> = (0..count).map(|row| 0.001 * row as f64).collect();
            let mut log = Dataset::new("here", "", time.clone()).expect("time rises");
            log.insert("command_1", time.iter().map(|time| 0.5 * time).collect()).expect("fits");
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("log.csv");
            write(&log, &path).expect("written");
            assert!(fs::read_to_string(&path).is_ok_and(|text| text == emit(&log)), "{count} rows");
            let again = read(&path).expect("a good log");
            assert_eq!((again.time(), again.column("command_1")), (&time[..], log.column("command_1")));
        }
    }

    #[test]
    fn byte_order_mark_spaces_and_short_rows_are_read() {
        let log = parse_text("\u{feff}time_s, command_1\r\n0, 0.5\r\n1\r\n").expect("a good log");
        assert_eq!(log.column("command_1").expect("there")[0], 0.5);
        assert!(log.column("command_1").expect("there")[1].is_nan());
    }

    #[test]
    fn errors_show_the_place() {
        let cases = [
            ("time_s,a\n0,1\n1,x\n", "log.csv, line 3, column `a`: `x` is not a number"),
            ("time_s,a\r\n\r\n0,1\r\n\r\n1,x\r\n", "log.csv, line 5, column `a`: `x` is not a number"),
            ("time_s,a\n0,inf\n", "log.csv, line 2, column `a`: `inf` is not a number"),
            ("time_s,a\n0,1,2\n", "log.csv, line 2: 3 cells under a header of 2"),
            (
                "time_s,a\n0,1\n\n,2\n",
                "log.csv, line 4: the cell of `time_s` is empty; every row needs its time (`import` \
                 leaves out rows without one, and says which)",
            ),
            (
                "t,a\n0,1\n",
                "log.csv: the header has no column `time_s`; it reads `t,a`; `import log.csv` shows what the columns of a foreign log may mean, and `--mapping` says it",
            ),
            (
                "",
                "log.csv: the header has no column `time_s`; it reads ``; `import log.csv` shows what the columns of a foreign log may mean, and `--mapping` says it",
            ),
            ("time_s,a,a\n0,1,1\n", "log.csv: column `a` is there twice"),
            (
                "time_s\n1\n0\n",
                "log.csv: time goes from 1 s to 0 s at sample 2; it must rise (`import` leaves out rows that go back, and says which)",
            ),
        ];
        for (text, message) in cases {
            assert_eq!(parse_text(text).unwrap_err().to_string(), message);
        }
        assert!(parse(b"time_s,a\n0,\xff\n", Path::new("log.csv")).is_err());
    }
}
