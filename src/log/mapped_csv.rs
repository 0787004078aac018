//! Reading a foreign CSV log through a mapping. Nothing is guessed and nothing is interpolated: what had to be left
//! out, cut or merged is counted and said.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::csv::content_hash;
use super::dataset::{Dataset, DatasetError, nanoseconds};
use super::lines::Lines;
use super::mapping::{Mapping, SignalMapping};
use crate::cancel;

/// Rows behind a backward stamp that are looked at to tell a glitch from a restart.
const RESTART_ROWS: usize = 10;
/// Places shown of each kind of oddity.
const PLACES: usize = 5;

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
    #[error("{path}: {reason} column `{column}` (for `{signal}`); the header reads {header}")]
    Column {
        /// The file.
        path: PathBuf,
        /// Name of the column.
        column: String,
        /// The signal that needs it.
        signal: String,
        /// `no` or `more than one`.
        reason: &'static str,
        /// The columns that are there.
        header: String,
    },
    /// A cell is not a number.
    #[error(
        "{path}, line {line}, column `{column}`: `{cell}` is not a number (if it means no value, name it in the \
         mapping's `missing`)"
    )]
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

/// How often something happened, and the first lines where.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Places {
    /// How often.
    pub count: usize,
    /// The first lines of the file where it happened.
    pub first_lines: Vec<u64>,
}

impl Places {
    fn add(&mut self, line: u64) {
        self.count += 1;
        if self.first_lines.len() < PLACES {
            self.first_lines.push(line);
        }
    }
}

/// What reading a foreign log came across.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Notes {
    /// The file began with a byte order mark.
    pub byte_order_mark: bool,
    /// Rows under the header, remarks apart.
    pub rows: usize,
    /// Lines that are remarks.
    pub remarks: usize,
    /// Rows with fewer cells than the header.
    pub short_rows: Places,
    /// Rows with more cells than the header; the surplus is not read.
    pub long_rows: Places,
    /// Lines that say the header again, left out.
    pub repeated_header: Places,
    /// The last line has no end: its last cell may have been cut in writing, and is left out.
    pub cut_cell: Places,
    /// Rows left out because they have no time.
    pub without_time: Places,
    /// Rows with the time of the row before: they fill its empty cells.
    pub repeated_time: Places,
    /// Cells left out because the row of the same time has another value there.
    pub conflicting_cells: Places,
    /// Rows left out because their time lies before that of an earlier row.
    pub backward_time: Places,
    /// Cells cut to the mapping's `clamp`, by signal.
    pub clamped: BTreeMap<String, Places>,
    /// Cells left out because they are outside the mapping's `valid`, by signal.
    pub invalid: BTreeMap<String, Places>,
    /// Signals of the mapping whose optional column is absent.
    pub absent: Vec<String>,
    /// Columns of the file that the mapping does not use.
    pub unused_columns: Vec<String>,
    /// Which log of the file was read, and of how many.
    pub part: Option<(usize, usize)>,
}

/// A row: its line, time and values in the order of the mapping's signals.
struct Row {
    line: u64,
    time: f64,
    values: Vec<f64>,
}

/// Reads the log at `path` through `mapping`. Where the file holds several logs, one behind the other, `part`
/// (from 1) chooses.
///
/// # Errors
/// [`ForeignError`] with file, line and column.
pub fn read(path: &Path, mapping: &Mapping, part: Option<usize>) -> Result<(Dataset, Notes), ForeignError> {
    let bytes = std::fs::read(path).map_err(|source| ForeignError::File { path: path.to_owned(), source })?;
    parse(&bytes, path, mapping, part)
}

/// Parses the bytes of a foreign log; `path` is for messages. See [`read`].
///
/// # Errors
/// [`ForeignError`] with file, line and column.
pub fn parse(
    bytes: &[u8],
    path: &Path,
    mapping: &Mapping,
    part: Option<usize>,
) -> Result<(Dataset, Notes), ForeignError> {
    let mut notes = Notes { byte_order_mark: bytes.starts_with(&[0xef, 0xbb, 0xbf]), ..Notes::default() };
    let (text, _, malformed) = mapping.encoding.decode(bytes);
    if malformed {
        let reason =
            format!("the bytes are not {} text; set `encoding` in the mapping", mapping.encoding.name());
        return Err(ForeignError::Syntax { path: path.to_owned(), line: None, reason });
    }
    let rows = Table { path, mapping, notes: &mut notes }.rows(&text)?;
    let rows = choose_part(rows, path, part, &mut notes)?;
    let rows = in_rising_time(rows, &mut notes);
    if rows.iter().all(|row| row.values.iter().all(|value| value.is_nan())) {
        return Err(ForeignError::Empty { path: path.to_owned() });
    }
    let time = rows.iter().map(|row| row.time).collect();
    let mut log = Dataset::new(path.display().to_string(), content_hash(bytes), time)?;
    for (index, signal) in mapping.config.signal.iter().enumerate() {
        if !notes.absent.contains(&signal.name) {
            log.insert(signal.name.clone(), rows.iter().map(|row| row.values[index]).collect())?;
        }
    }
    Ok((log, notes))
}

/// Reads rows as the file has them.
struct Table<'a> {
    path: &'a Path,
    mapping: &'a Mapping,
    notes: &'a mut Notes,
}

impl Table<'_> {
    fn rows(&mut self, text: &str) -> Result<Vec<Row>, ForeignError> {
        let config = &self.mapping.config;
        let skipped: usize = text.split_inclusive('\n').take(config.skip_lines).map(str::len).sum();
        let body = text.get(skipped..).unwrap_or("");
        let is_remark = |line: &&str| config.comment.is_some_and(|comment| line.starts_with(comment));
        self.notes.remarks = body.lines().filter(is_remark).count();
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(config.delimiter as u8)
            .comment(config.comment.map(|comment| comment as u8))
            .has_headers(config.header)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(body.as_bytes());
        let header: Vec<String> = match reader.headers() {
            Ok(cells) if config.header => cells.iter().map(str::to_owned).collect(),
            Ok(cells) => (1..=cells.len()).map(|number| format!("#{number}")).collect(),
            Err(error) => return Err(self.syntax(&error)),
        };
        let columns = self.columns(&header)?;
        let comment = config.comment.map(|comment| comment as u8);
        let mut lines = Lines::new(body.as_bytes(), comment, config.skip_lines as u64 + 1);
        let mut rows = Vec::new();
        let mut record = csv::StringRecord::new();
        let unfinished = body.rfind(['\n', '\r']).map_or(0, |end| end + 1);
        let is_unfinished = !body[unfinished..].trim().is_empty() && !is_remark(&&body[unfinished..]);
        while reader.read_record(&mut record).map_err(|error| self.syntax(&error))? {
            cancel::check();
            let line = lines.of(record.position());
            if config.header && record.iter().eq(header.iter()) {
                self.notes.repeated_header.add(line);
                continue;
            }
            self.notes.rows += 1;
            let begin = record.position().map_or(0, |position| position.byte() as usize);
            if is_unfinished && begin >= unfinished && !record.is_empty() {
                self.notes.cut_cell.add(line);
                record.truncate(record.len() - 1);
            }
            match record.len().cmp(&header.len()) {
                std::cmp::Ordering::Less => self.notes.short_rows.add(line),
                std::cmp::Ordering::Greater => self.notes.long_rows.add(line),
                std::cmp::Ordering::Equal => {}
            }
            if let Some(row) = self.row(&record, line, &columns)? {
                rows.push(row);
            }
        }
        Ok(rows)
    }

    fn syntax(&self, error: &csv::Error) -> ForeignError {
        let line = error.position().map(|position| position.line() + self.mapping.config.skip_lines as u64);
        ForeignError::Syntax { path: self.path.to_owned(), line, reason: error.to_string() }
    }

    /// Where time and each signal stand in the file.
    fn columns(&mut self, header: &[String]) -> Result<Columns, ForeignError> {
        let find = |column: &str, signal: &str| {
            let mut places =
                header.iter().enumerate().filter(|(_, name)| *name == column).map(|(place, _)| place);
            let (place, again) = (places.next(), places.next());
            let reason = if again.is_some() { "more than one" } else { "no" };
            place.filter(|_| again.is_none()).ok_or_else(|| ForeignError::Column {
                path: self.path.to_owned(),
                column: column.to_owned(),
                signal: signal.to_owned(),
                reason,
                header: header.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
            })
        };
        let config = &self.mapping.config;
        let time = config.time.column.as_deref().map(|column| find(column, "time_s")).transpose()?;
        let mut signals = Vec::new();
        for signal in &config.signal {
            match find(&signal.column, &signal.name) {
                Ok(place) => signals.push(Some(place)),
                Err(ForeignError::Column { reason: "no", .. }) if signal.optional => {
                    self.notes.absent.push(signal.name.clone());
                    signals.push(None);
                }
                Err(error) => return Err(error),
            }
        }
        let used = |place: usize| time == Some(place) || signals.contains(&Some(place));
        let unused = header.iter().enumerate().filter(|(place, name)| !used(*place) && !name.is_empty());
        self.notes.unused_columns = unused.map(|(_, name)| name.clone()).collect();
        Ok(Columns { time, signals })
    }

    /// The row's numbers; `None` when it has no time.
    fn row(
        &mut self,
        record: &csv::StringRecord,
        line: u64,
        columns: &Columns,
    ) -> Result<Option<Row>, ForeignError> {
        let config = &self.mapping.config;
        let time = match (columns.time, config.time.period_s) {
            (Some(place), _) => {
                let column = config.time.column.as_deref().unwrap_or_default();
                self.mapping.time_unit.to_si(self.number(record.get(place), line, column)?)
            }
            (None, period) => (self.notes.rows - 1) as f64 * period.unwrap_or(f64::NAN),
        };
        if !time.is_finite() {
            self.notes.without_time.add(line);
            return Ok(None);
        }
        let mut values = Vec::with_capacity(config.signal.len());
        for (index, (signal, place)) in config.signal.iter().zip(&columns.signals).enumerate() {
            let cell = place.and_then(|place| record.get(place));
            let number = self.number(cell, line, &signal.column)?;
            let unit = self.mapping.units.get(index).copied().flatten();
            let scaled = number * signal.scale + signal.offset;
            values.push(self.limited(signal, unit.map_or(scaled, |unit| unit.to_si(scaled)), line));
        }
        Ok(Some(Row { line, time, values }))
    }

    /// A cell's number; not-a-number for one that holds no value.
    fn number(&self, cell: Option<&str>, line: u64, column: &str) -> Result<f64, ForeignError> {
        let cell = cell.unwrap_or("");
        let config = &self.mapping.config;
        if cell.is_empty() || cell.eq_ignore_ascii_case("nan") || config.missing.iter().any(|it| it == cell) {
            return Ok(f64::NAN);
        }
        let parsed = if config.decimal_comma { cell.replace(',', ".").parse() } else { cell.parse() };
        parsed.ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| ForeignError::Cell {
            path: self.path.to_owned(),
            line,
            column: column.to_owned(),
            cell: cell.to_owned(),
        })
    }

    /// The value within the mapping's ranges.
    fn limited(&mut self, signal: &SignalMapping, value: f64, line: u64) -> f64 {
        if signal.valid.is_some_and(|[low, high]| value < low || value > high) {
            self.notes.invalid.entry(signal.name.clone()).or_default().add(line);
            return f64::NAN;
        }
        match signal.clamp {
            Some([low, high]) if value < low || value > high => {
                self.notes.clamped.entry(signal.name.clone()).or_default().add(line);
                value.clamp(low, high)
            }
            _ => value,
        }
    }
}

/// Places of the columns.
struct Columns {
    time: Option<usize>,
    signals: Vec<Option<usize>>,
}

/// The rows of one log: where time goes back and does not return, another one begins.
fn choose_part(
    rows: Vec<Row>,
    path: &Path,
    part: Option<usize>,
    notes: &mut Notes,
) -> Result<Vec<Row>, ForeignError> {
    let mut starts = vec![0];
    let mut latest = f64::NEG_INFINITY;
    for (index, row) in rows.iter().enumerate() {
        let returns = || rows[index..].iter().take(RESTART_ROWS).any(|later| later.time > latest);
        let is_restart = row.time < latest && index + RESTART_ROWS < rows.len() && !returns();
        if is_restart {
            starts.push(index);
        }
        latest = if is_restart { row.time } else { latest.max(row.time) };
    }
    let parts = starts.len();
    let path = path.to_owned();
    match (part, starts.get(1)) {
        (None, None) => Ok(rows),
        (None, Some(second)) => {
            let (before, at) = (&rows[second - 1], &rows[*second]);
            Err(ForeignError::Restart { path, line: at.line, before: before.time, after: at.time, parts })
        }
        (Some(part), _) if (1..=parts).contains(&part) => {
            notes.part = Some((part, parts));
            let end = starts.get(part).copied().unwrap_or(rows.len());
            Ok(rows.into_iter().take(end).skip(starts[part - 1]).collect())
        }
        (Some(part), _) => Err(ForeignError::Part { path, part, parts }),
    }
}

/// Rows with strictly rising time: equal stamps are merged, backward ones left out.
fn in_rising_time(rows: Vec<Row>, notes: &mut Notes) -> Vec<Row> {
    let mut kept: Vec<Row> = Vec::with_capacity(rows.len());
    for row in rows {
        match kept.last_mut() {
            Some(last) if row.time < last.time => notes.backward_time.add(row.line),
            Some(last) if row.time == last.time => {
                notes.repeated_time.add(row.line);
                for (mine, other) in last.values.iter_mut().zip(&row.values) {
                    if mine.is_nan() {
                        *mine = *other;
                    } else if !other.is_nan() && mine != other {
                        notes.conflicting_cells.add(row.line);
                    }
                }
            }
            _ => kept.push(row),
        }
    }
    kept
}
