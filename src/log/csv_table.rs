//! The cells of a foreign CSV file as numbers: tables of the columns that a mapping names, one for each clock.

use super::csv_blocks::number;
use super::foreign_error::ForeignError;
use super::import_notes::Notes;
use super::limits::{not_names, shortened};
use super::lines::Lines;
use super::mapping::{Mapping, MappingConfig, TimeConfig};
use super::signals::log_signal;
use super::tables::{Column, Table};
use super::text_tail;
use crate::cancel;
use crate::signal::columns;
use std::path::Path;

/// Columns of a header that a message shows.
const SHOWN_COLUMNS: usize = 24;

/// Reads the columns that `mapping` names, and notes what is odd.
///
/// # Errors
/// [`ForeignError`] with file, line and column.
pub(crate) fn read(
    bytes: &[u8],
    path: &Path,
    mapping: &Mapping,
    notes: &mut Notes,
) -> Result<Vec<Table>, ForeignError> {
    notes.byte_order_mark = bytes.starts_with(&[0xef, 0xbb, 0xbf]);
    let (text, _, malformed) = mapping.encoding.decode(bytes);
    if malformed {
        let reason =
            format!("the bytes are not {} text; set `encoding` in the mapping", mapping.encoding.name());
        return Err(ForeignError::Syntax { path: path.to_owned(), line: None, reason });
    }
    Reader { path, mapping, notes, parted_by: None }.read(&text)
}

/// A column on its way into a table.
struct Wanted {
    /// Place in the file.
    place: usize,
    /// Its clock, as a number of [`Clock`].
    clock: usize,
    /// Whether it is only carried along: text in it is no mistake.
    is_carried: bool,
    column: Column,
}

/// A clock, and the table that it makes.
struct Clock {
    /// Place and name of its column; `None` = a fixed period.
    column: Option<(usize, String)>,
    table: Table,
}

/// Where in a text what is to be read ends.
struct Ends {
    /// Of rows, where text is behind them.
    rows: Option<usize>,
    /// Of whole lines, where the last one has no end.
    whole: Option<usize>,
}

impl Ends {
    fn of(body: &str, config: &MappingConfig, columns: usize) -> Self {
        let rows = text_tail::begin(body, config, columns);
        let whole = body.rfind(['\n', '\r']).map_or(0, |end| end + 1);
        let last = &body[whole..];
        let is_remark = config.comment.is_some_and(|comment| last.starts_with(comment));
        let is_unfinished = !last.trim().is_empty() && !is_remark;
        Self { rows: (rows < body.len()).then_some(rows), whole: is_unfinished.then_some(whole) }
    }
}

struct Reader<'a> {
    path: &'a Path,
    mapping: &'a Mapping,
    notes: &'a mut Notes,
    /// Another character than the mapping's that seems to stand between the cells of the first line.
    parted_by: Option<char>,
}

impl Reader<'_> {
    fn config(&self) -> &MappingConfig {
        &self.mapping.config
    }

    fn period_s(&self) -> Option<f64> {
        self.config().time.as_ref().and_then(TimeConfig::period)
    }

    fn read(&mut self, text: &str) -> Result<Vec<Table>, ForeignError> {
        let config = self.mapping.config.clone();
        let skipped: usize = text.split_inclusive('\n').take(config.skip_lines).map(str::len).sum();
        let body = text.get(skipped..).unwrap_or("");
        let is_remark = |line: &&str| config.comment.is_some_and(|comment| line.starts_with(comment));
        self.note_remarks(body.lines().filter(is_remark));
        let comment = config.comment.map(|comment| comment as u8);
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(config.delimiter as u8)
            .comment(comment)
            .has_headers(config.header)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(body.as_bytes());
        let header = self.header(reader.headers())?;
        let (mut clocks, mut wanted) = self.columns(&header)?;
        let mut lines = Lines::new(body.as_bytes(), comment, config.skip_lines as u64 + 1);
        let mut record = csv::StringRecord::new();
        let ends = Ends::of(body, &config, header.len());
        while reader.read_record(&mut record).map_err(|error| self.syntax(&error))? {
            cancel::check();
            let line = lines.of(record.position());
            if self.is_row(&mut record, line, &header, &ends) {
                self.row(&record, line, &mut clocks, &mut wanted)?;
            }
        }
        for wanted in wanted {
            if let Some(clock) = clocks.get_mut(wanted.clock) {
                clock.table.columns.push(wanted.column);
            }
        }
        Ok(clocks.into_iter().map(|clock| clock.table).collect())
    }

    /// Whether a record is a row under the header; notes what is odd about it.
    fn is_row(&mut self, record: &mut csv::StringRecord, line: u64, header: &[String], ends: &Ends) -> bool {
        if self.config().header && record.iter().eq(header.iter()) {
            self.notes.repeated_header.add(line);
            return false;
        }
        let begin = record.position().map_or(0, |position| position.byte() as usize);
        // The reader begins to look for a row between the two letters of a line's end.
        if ends.rows.is_some_and(|rows| begin + 1 >= rows) {
            self.notes.text_behind.add(line);
            return false;
        }
        self.notes.rows += 1;
        if ends.whole.is_some_and(|whole| begin >= whole) && !record.is_empty() {
            self.notes.cut_cell.add(line);
            record.truncate(record.len() - 1);
        }
        match record.len().cmp(&header.len()) {
            std::cmp::Ordering::Less => self.notes.short_rows.add(line),
            std::cmp::Ordering::Greater => self.notes.long_rows.add(line),
            std::cmp::Ordering::Equal => {}
        }
        true
    }

    fn note_remarks<'a>(&mut self, mut remarks: impl Iterator<Item = &'a str>) {
        let first = remarks.next();
        self.notes.remarks = usize::from(first.is_some()) + remarks.count();
        self.notes.first_remark = first.map(shortened);
    }

    /// The names of the columns; of a file without a header, their numbers.
    fn header(&mut self, first: csv::Result<&csv::StringRecord>) -> Result<Vec<String>, ForeignError> {
        let cells = first.map_err(|error| self.syntax(&error))?;
        self.parted_by = other_delimiter(cells, self.config().delimiter);
        if let Some(reason) = not_names(cells.iter().collect::<Vec<_>>().into_iter()) {
            return Err(ForeignError::Syntax { path: self.path.to_owned(), line: Some(1), reason });
        }
        Ok(if self.config().header {
            cells.iter().map(str::to_owned).collect()
        } else {
            (1..=cells.len()).map(|number| format!("#{number}")).collect()
        })
    }

    /// One row more of each table.
    fn row(
        &mut self,
        record: &csv::StringRecord,
        line: u64,
        clocks: &mut [Clock],
        wanted: &mut [Wanted],
    ) -> Result<(), ForeignError> {
        for clock in clocks.iter_mut() {
            let time = match (&clock.column, self.period_s()) {
                (Some((place, name)), _) => {
                    self.mapping.time_unit.to_si(self.number(record.get(*place), line, name)?)
                }
                (None, period) => (self.notes.rows - 1) as f64 * period.unwrap_or(f64::NAN),
            };
            clock.table.time.push(time);
            clock.table.lines.push(line);
        }
        for wanted in wanted {
            let number = match self.number(record.get(wanted.place), line, &wanted.column.name) {
                Err(ForeignError::Cell { .. }) if wanted.is_carried => {
                    self.notes.texts.entry(wanted.column.name.clone()).or_default().add(line);
                    f64::NAN
                }
                number => number?,
            };
            wanted.column.values.push(number);
        }
        Ok(())
    }

    fn syntax(&self, error: &csv::Error) -> ForeignError {
        let line = error.position().map(|position| position.line() + self.config().skip_lines as u64);
        ForeignError::Syntax { path: self.path.to_owned(), line, reason: error.to_string() }
    }

    /// The clocks that the mapping names, and the columns beside them; the table of each clock has its column's name, but
    /// for the first, which has none.
    fn columns(&mut self, header: &[String]) -> Result<(Vec<Clock>, Vec<Wanted>), ForeignError> {
        let config = self.mapping.config.clone();
        let empty = |name: String| Table::new(name, Vec::new());
        let first = match config.time.as_ref().and_then(|time| time.column.as_ref()) {
            Some(column) => Some((self.find(header, column, columns::TIME)?, column.clone())),
            None => None,
        };
        let mut clocks = vec![Clock { column: first, table: empty(String::new()) }];
        let mut wanted: Vec<Wanted> = Vec::new();
        let mut used: Vec<usize> = clocks[0].column.iter().map(|(place, _)| *place).collect();
        let filter = self.mapping.filter.as_ref();
        let of_filter = filter.map(|filter| (filter.column.clone(), None, "where", false));
        let of_signals = config.signal.iter().flat_map(|signal| {
            let clock = signal.time_column.clone();
            let each = signal.columns().iter().map(|column| column.to_string()).collect::<Vec<_>>();
            let may_lack = !config.is_needed(signal);
            each.into_iter().map(move |it| (it, clock.clone(), signal.name.as_str(), may_lack))
        });
        self.require_one_of_several(header)?;
        for (column, clock, signal, is_optional) in of_filter.into_iter().chain(of_signals) {
            let place = match self.find(header, &column, signal) {
                Ok(place) => place,
                Err(ForeignError::Column { reason: "no", .. }) if is_optional => continue,
                Err(error) => return Err(error),
            };
            used.push(place);
            let clock = match clock {
                None => 0,
                Some(name) => match clocks.iter().position(|it| it.table.name == name) {
                    Some(known) => known,
                    None => {
                        let place = self.find(header, &name, signal)?;
                        used.push(place);
                        clocks.push(Clock { column: Some((place, name.clone())), table: empty(name) });
                        clocks.len() - 1
                    }
                },
            };
            let is_carried = signal != "where" && log_signal(signal).is_none();
            if let Some(known) = wanted.iter_mut().find(|it| it.place == place && it.clock == clock) {
                known.is_carried &= is_carried;
                continue;
            }
            let column = Column { name: column, unit: None, values: Vec::new() };
            wanted.push(Wanted { place, clock, is_carried, column });
        }
        let unused = header.iter().enumerate().filter(|(at, name)| !used.contains(at) && !name.is_empty());
        self.notes.unused_columns = unused.map(|(_, name)| name.clone()).collect();
        Ok((clocks, wanted))
    }

    /// Refuses a file that has no column for a signal that may come from several.
    fn require_one_of_several(&self, header: &[String]) -> Result<(), ForeignError> {
        let has = |name: &&str| header.iter().any(|it| it == name);
        let config = self.config();
        for signal in config.one_of_several() {
            let all: Vec<Vec<&str>> = config.alternatives(&signal.name).map(|(_, it)| it.columns()).collect();
            if !all.iter().any(|columns| columns.iter().all(has)) {
                return self.find(header, &all.concat().join("`, `"), &signal.name).map(|_| ());
            }
        }
        Ok(())
    }

    /// The one place of a column in the header.
    fn find(&self, header: &[String], column: &str, signal: &str) -> Result<usize, ForeignError> {
        let mut places = header.iter().enumerate().filter(|(_, name)| *name == column);
        let (place, again) = (places.next(), places.next());
        let reason = if again.is_some() { "more than one" } else { "no" };
        place.filter(|_| again.is_none()).map(|(place, _)| place).ok_or_else(|| ForeignError::Column {
            path: self.path.to_owned(),
            column: column.to_owned(),
            signal: signal.into(),
            mapping: self.mapping.name.as_str().into(),
            reason,
            header: listed(header.iter().map(String::as_str)).into(),
            delimiter: self.parted_by,
        })
    }

    /// A cell's number; not-a-number for one that holds no value.
    fn number(&self, cell: Option<&str>, line: u64, column: &str) -> Result<f64, ForeignError> {
        let cell = cell.unwrap_or("");
        let config = self.config();
        if config.missing.iter().any(|it| it == cell) {
            return Ok(f64::NAN);
        }
        let parsed = if config.decimal_comma { number(&cell.replace(',', ".")) } else { number(cell) };
        parsed.ok_or_else(|| ForeignError::Cell {
            path: self.path.to_owned(),
            line,
            column: column.to_owned(),
            cell: shortened(cell),
        })
    }
}

/// A character that parts a first line into more cells than the mapping's does.
fn other_delimiter(cells: &csv::StringRecord, own: char) -> Option<char> {
    let parts = |other: &char| -> bool {
        *other != own && cells.iter().map(|cell| cell.matches(*other).count()).sum::<usize>() >= cells.len()
    };
    ['\t', ';', ',', '|'].into_iter().find(parts)
}

/// Names of columns, for a message: the first ones, and how many there are.
pub(crate) fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    let shown = names.iter().take(SHOWN_COLUMNS).map(|name| format!("`{}`", shortened(name)));
    let shown = shown.collect::<Vec<_>>().join(", ");
    let more = names.len().saturating_sub(SHOWN_COLUMNS);
    if more > 0 { format!("{shown} and {more} more") } else { shown }
}
