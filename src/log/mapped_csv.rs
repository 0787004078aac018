//! Reading a foreign CSV log through a mapping. Nothing is guessed and nothing is interpolated: what had to be left
//! out, cut or merged is counted and said.

use std::path::Path;

use super::csv::{content_hash, number};
use super::dataset::Dataset;
pub use super::foreign_error::ForeignError;
pub use super::import_notes::{Notes, Places};
use super::lines::Lines;
use super::mapping::{Mapping, SignalMapping};
use super::thresholds::THRESHOLDS;
use crate::cancel;

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
        if config.missing.iter().any(|it| it == cell) {
            return Ok(f64::NAN);
        }
        let parsed = if config.decimal_comma { number(&cell.replace(',', ".")) } else { number(cell) };
        parsed.ok_or_else(|| ForeignError::Cell {
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
        let returns = || rows[index..].iter().take(THRESHOLDS.restart_rows).any(|later| later.time > latest);
        let is_restart = row.time < latest && index + THRESHOLDS.restart_rows < rows.len() && !returns();
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
