//! A foreign log through a mapping. Nothing is guessed and nothing is interpolated: what had to be left out, cut or merged
//! is counted and said.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use super::csv::content_hash;
use super::csv_table::{self, listed};
use super::dataset::{Dataset, DatasetError};
use super::foreign_error::ForeignError;
use super::import_notes::{Instead, Notes};
use super::limited::limited;
use super::limits;
use super::mapping::{Mapping, SignalMapping, TimeConfig};
use super::narrow_range::NarrowRange;
use super::row_clock;
use super::signals::rotor_of;
use super::table_clock::Clock;
use super::tables::{Table, Tables};
use crate::signal::columns;

/// Reads the CSV log at `path` through `mapping`. Where the file holds several logs, one behind the other, `part`
/// (from 1) chooses.
///
/// # Errors
/// [`ForeignError`] with file, line and column.
pub fn read(path: &Path, mapping: &Mapping, part: Option<usize>) -> Result<(Dataset, Notes), ForeignError> {
    let bytes = limits::read(path).map_err(|source| ForeignError::File { path: path.to_owned(), source })?;
    parse(&bytes, path, mapping, part)
}

/// Parses the bytes of a foreign CSV log; `path` is for messages. See [`read`].
///
/// # Errors
/// [`ForeignError`] with file, line and column.
pub fn parse(
    bytes: &[u8],
    path: &Path,
    mapping: &Mapping,
    part: Option<usize>,
) -> Result<(Dataset, Notes), ForeignError> {
    if mapping.config.time.is_none() {
        return Err(ForeignError::NoClock { path: path.to_owned() });
    }
    let mut notes = Notes::default();
    let tables = csv_table::read(bytes, path, mapping, &mut notes)?;
    let log = Assembly { path, mapping, part, notes: &mut notes }.log(&tables, bytes)?;
    Ok((log, notes))
}

/// The log that `mapping` makes of the tables of a file with the content `bytes`; `path` is for messages.
///
/// # Errors
/// [`ForeignError`] with file and column.
pub fn assemble(
    tables: &Tables,
    bytes: &[u8],
    path: &Path,
    mapping: &Mapping,
) -> Result<(Dataset, Notes), ForeignError> {
    let rows = tables.tables.iter().map(|table| table.time.len()).sum();
    let mut notes = Notes {
        rows,
        skipped: tables.skipped.clone(),
        about: tables.about.clone(),
        part: tables.part,
        ..Notes::default()
    };
    let used: Vec<&str> = mapping.config.signal.iter().flat_map(SignalMapping::columns).collect();
    let all = tables.tables.iter().flat_map(|table| table.columns.iter().map(|it| table.full_name(it)));
    notes.unused_columns = all.filter(|name| !used.iter().any(|it| names(it, name))).collect();
    let mut assembly = Assembly { path, mapping, part: None, notes: &mut notes };
    let clocked = assembly.clocked(&tables.tables)?;
    let log = assembly.log(&clocked, bytes)?;
    Ok((log, notes))
}

/// Whether `wanted`, as a mapping writes it, means the column with this full name.
fn names(wanted: &str, full: &str) -> bool {
    full == wanted || full.strip_suffix(wanted).is_some_and(|table| table.ends_with('.'))
}

/// What makes a log of tables.
struct Assembly<'a> {
    path: &'a Path,
    mapping: &'a Mapping,
    part: Option<usize>,
    notes: &'a mut Notes,
}

impl Assembly<'_> {
    /// The tables with a clock each: those that have none take it from the mapping.
    fn clocked<'a>(&self, tables: &'a [Table]) -> Result<Cow<'a, [Table]>, ForeignError> {
        let rows = |table: &Table| table.columns.first().map_or(0, |column| column.values.len());
        let lacks_clock = |table: &Table| table.time.is_empty() && rows(table) > 0;
        if !tables.iter().any(lacks_clock) {
            return Ok(Cow::Borrowed(tables));
        }
        let time = self.mapping.config.time.as_ref();
        let mut tables = tables.to_vec();
        let of_column = time.and_then(|time| time.column.as_deref());
        let place =
            of_column.map(|column| self.find_named(&tables, column, columns::TIME, None)).transpose()?;
        let period = time.and_then(TimeConfig::period);
        let stamps = place.map(|(table, at)| tables[table].columns[at].values.clone());
        for table in tables.iter_mut().filter(|table| lacks_clock(table)) {
            table.time = match (&stamps, period) {
                (Some(stamps), _) if stamps.len() == rows(table) => {
                    stamps.iter().map(|stamp| self.mapping.time_unit.to_si(*stamp)).collect()
                }
                (None, Some(period)) => (0..rows(table)).map(|row| row as f64 * period).collect(),
                _ => return Err(ForeignError::NoClock { path: self.path.to_owned() }),
            };
        }
        Ok(Cow::Owned(tables))
    }

    fn log(&mut self, tables: &[Table], bytes: &[u8]) -> Result<Dataset, ForeignError> {
        let count = self.mapping.config.signal.len();
        let mut clocks = Vec::new();
        for clock in self.clocks(tables)? {
            let mut clock = clock.with_time(self.notes).part(self.path, self.part, self.notes)?;
            for (signal, values) in &mut clock.signals {
                moved_up(values, self.mapping.config.signal[*signal % count].rows_later);
            }
            let mut clock = clock.in_rising_time(count, self.notes);
            self.put_slopes(&mut clock)?;
            clocks.push(clock);
        }
        // Behind the signals stand those of them that were cut, uncut.
        let (time, mut columns) = self.in_rows(clocks, 2 * count);
        let uncut = columns.split_off(count);
        if columns.iter().flatten().all(|values| values.iter().all(|value| value.is_nan())) {
            return Err(ForeignError::Empty { path: self.path.to_owned() });
        }
        let mut log = Dataset::new(self.path.display().to_string(), content_hash(bytes), time)?;
        let signals = || self.mapping.config.signal.iter();
        for (signal, column) in signals().zip(&mut columns) {
            if let Some(values) = column.take() {
                log.insert(signal.name.clone(), values)?;
            }
        }
        let absent = signals().filter(|it| !it.instead && log.column(&it.name).is_none());
        self.notes.absent.extend(absent.map(|it| it.name.clone()));
        let of = |(index, uncut): (usize, Option<Vec<f64>>)| {
            let signal = &self.mapping.config.signal[index];
            let rates = rotor_of(&signal.name).and_then(|rotor| log.column(&columns::propeller_rate(rotor)));
            NarrowRange::of(signal, self.mapping.units.get(index).copied().flatten(), &uncut?, rates)
        };
        self.notes.narrow_ranges = uncut.into_iter().enumerate().filter_map(of).collect();
        Ok(log)
    }

    /// The signals by the clock that they have, and in SI.
    fn clocks(&mut self, tables: &[Table]) -> Result<Vec<Clock>, ForeignError> {
        let mut clocks: Vec<Option<Clock>> = tables.iter().map(|_| None).collect();
        let is_read = self.signals_read(tables);
        for (index, signal) in
            self.mapping.config.signal.iter().enumerate().filter(|(index, _)| is_read[*index])
        {
            let found: Result<Vec<_>, _> =
                signal.columns().into_iter().map(|column| self.find(tables, column, signal)).collect();
            let found = match found {
                Err(ForeignError::Column { reason: "no", .. }) if signal.optional => continue,
                found => found?,
            };
            let Some((at, _)) = found.first().copied() else { continue };
            if found.iter().any(|(table, _)| *table != at) {
                return Err(ForeignError::Column {
                    path: self.path.to_owned(),
                    column: signal.columns().join("`, `"),
                    signal: signal.name.as_str().into(),
                    mapping: self.mapping.name.as_str().into(),
                    reason: "in one table, with one clock, there are not all of",
                    header: listed(tables.iter().map(|table| table.name.as_str())).into(),
                    delimiter: None,
                });
            }
            let values = self.values(&tables[at], index, &found);
            let uncut = self.uncut(&tables[at], index, &found);
            let clock = clocks[at].get_or_insert_with(|| Clock::of(&tables[at]));
            clock.signals.push((index, values));
            clock.signals.extend(uncut.map(|values| (self.mapping.config.signal.len() + index, values)));
        }
        if let Some(filter) = &self.mapping.filter {
            let (at, column) = self.find_named(tables, &filter.column, "where", None)?;
            let condition = tables[at].columns.get(column).map(|column| column.values.clone());
            clocks[at].get_or_insert_with(|| Clock::of(&tables[at])).condition = condition;
        }
        Ok(clocks.into_iter().flatten().collect())
    }

    /// Which signals are read: of several of one name the first whose columns are there and read anything but 0, else the first whose
    /// columns are there, else the first.
    fn signals_read(&mut self, tables: &[Table]) -> Vec<bool> {
        let config = &self.mapping.config;
        let mut is_read: Vec<bool> = config.signal.iter().map(|signal| !signal.instead).collect();
        let moves = |(table, column): &(usize, usize)| {
            let values = &tables[*table].columns[*column].values;
            values.iter().any(|value| value.is_finite() && *value != 0.0)
        };
        for (first, named) in config.signal.iter().enumerate().filter(|(_, signal)| !signal.instead) {
            let all: Vec<(usize, &SignalMapping)> = config.alternatives(&named.name).collect();
            if all.len() < 2 {
                continue;
            }
            let places = |signal: &SignalMapping| -> Option<Vec<(usize, usize)>> {
                signal.columns().into_iter().map(|column| self.find(tables, column, signal).ok()).collect()
            };
            let there: Vec<_> = all.into_iter().filter_map(|(at, it)| Some((at, it, places(it)?))).collect();
            let alive = there.iter().position(|(_, _, places)| places.iter().any(moves)).unwrap_or(0);
            let Some((chosen, signal, _)) = there.get(alive) else { continue };
            (is_read[first], is_read[*chosen]) = (false, true);
            if alive > 0 {
                let [read, dead] = [*signal, there[0].1].map(|it| it.columns().join("`, `"));
                self.notes.instead.push(Instead { signal: named.name.clone(), read, dead });
            }
        }
        is_read
    }

    /// Puts in the place of columns whose slope is wanted that slope.
    fn put_slopes(&mut self, clock: &mut Clock) -> Result<(), DatasetError> {
        let of_slope: Vec<usize> = (0..clock.signals.len())
            .filter(|at| self.mapping.config.signal.get(clock.signals[*at].0).is_some_and(|it| it.slope))
            .collect();
        if of_slope.is_empty() {
            return Ok(());
        }
        let segments = Dataset::new(self.path.display().to_string(), "", clock.time.clone())?.segments();
        for at in of_slope {
            let (index, values) = &clock.signals[at];
            let slopes = slopes(&clock.time, values, &segments);
            let places = clock.places.iter().copied();
            clock.signals[at].1 = slopes
                .into_iter()
                .zip(places)
                .map(|(slope, place)| self.value(*index, slope, place))
                .collect();
        }
        Ok(())
    }

    /// A number of the file in SI and within the mapping's ranges.
    fn value(&mut self, index: usize, number: f64, place: u64) -> f64 {
        let signal = &self.mapping.config.signal[index];
        let unit = self.mapping.units.get(index).copied().flatten();
        let scaled = number * signal.scale + signal.offset;
        limited(self.notes, signal, unit.map_or(scaled, |unit| unit.to_si(scaled)), place)
    }

    /// The values of a signal, in SI and within the mapping's ranges; where its slope is wanted, the numbers as they are.
    fn values(&mut self, table: &Table, index: usize, places: &[(usize, usize)]) -> Vec<f64> {
        let signal = &self.mapping.config.signal[index];
        let columns: Vec<&[f64]> =
            places.iter().filter_map(|(_, at)| table.columns.get(*at)).map(|it| &it.values[..]).collect();
        let mut values = Vec::with_capacity(table.time.len());
        for row in 0..table.time.len() {
            let numbers = columns.iter().map(|column| column.get(row).copied().unwrap_or(f64::NAN));
            let number = signal.combined(numbers);
            values.push(if signal.slope { number } else { self.value(index, number, table.place(row)) });
        }
        values
    }

    /// The values of a command in SI, where the mapping cuts some of them; `None` of any other.
    fn uncut(&self, table: &Table, index: usize, places: &[(usize, usize)]) -> Option<Vec<f64>> {
        let signal = &self.mapping.config.signal[index];
        let is_cut = columns::is_command(&signal.name) && self.notes.clamped.contains_key(&signal.name);
        if !is_cut || signal.slope {
            return None;
        }
        let unit = self.mapping.units.get(index).copied().flatten();
        let columns = || places.iter().filter_map(|(_, at)| table.columns.get(*at));
        let value = |row: usize| {
            let numbers = columns().map(|it| it.values.get(row).copied().unwrap_or(f64::NAN));
            let scaled = signal.combined(numbers) * signal.scale + signal.offset;
            unit.map_or(scaled, |unit| unit.to_si(scaled))
        };
        Some((0..table.time.len()).map(value).collect())
    }

    fn find(
        &self,
        tables: &[Table],
        column: &str,
        signal: &SignalMapping,
    ) -> Result<(usize, usize), ForeignError> {
        self.find_named(tables, column, &signal.name, signal.time_column.as_deref())
    }

    /// Table and place of the one column that `column` means.
    fn find_named(
        &self,
        tables: &[Table],
        column: &str,
        signal: &str,
        clock: Option<&str>,
    ) -> Result<(usize, usize), ForeignError> {
        // The tables of a text file are named after their clocks, and a column is found by its own name there.
        let is_text = tables.iter().any(|table| !table.lines.is_empty());
        let is_meant = |table: &Table, at: usize| {
            let own = &table.columns[at];
            let in_clock = is_text && table.name == clock.unwrap_or_default() && own.name == column;
            in_clock || (!is_text && names(column, &table.full_name(own)))
        };
        let mut found = Vec::new();
        for (number, table) in tables.iter().enumerate() {
            found.extend((0..table.columns.len()).filter(|at| is_meant(table, *at)).map(|at| (number, at)));
        }
        // A full name means the column of that name, also where it ends like another.
        let exact =
            |(table, at): &(usize, usize)| tables[*table].full_name(&tables[*table].columns[*at]) == column;
        if found.len() > 1 {
            found.retain(exact);
        }
        match found[..] {
            [place] => Ok(place),
            _ => {
                let all: Vec<String> = tables
                    .iter()
                    .flat_map(|table| table.columns.iter().map(|column| table.full_name(column)))
                    .collect();
                Err(ForeignError::Column {
                    path: self.path.to_owned(),
                    column: column.to_owned(),
                    signal: signal.into(),
                    mapping: self.mapping.name.as_str().into(),
                    reason: if found.is_empty() { "no" } else { "more than one" },
                    header: listed(all.iter().map(String::as_str)).into(),
                    delimiter: None,
                })
            }
        }
    }

    /// All clocks in the rows of one: time, and the values of each signal that is there.
    fn in_rows(&mut self, mut clocks: Vec<Clock>, signals: usize) -> (Vec<f64>, Vec<Option<Vec<f64>>>) {
        let stamps: Vec<&[f64]> = clocks.iter().map(|clock| &clock.time[..]).collect();
        let merged = row_clock::merge(&stamps);
        self.notes.greatest_shift_s = merged.greatest_shift;
        let mut columns: Vec<Option<Vec<f64>>> = vec![None; signals];
        let mut condition = None;
        for (clock, places) in clocks.iter_mut().zip(&merged.places) {
            let placed = |values: Vec<f64>| {
                if places.len() == merged.time.len() {
                    return values;
                }
                let mut rows = vec![f64::NAN; merged.time.len()];
                for (row, value) in places.iter().zip(values).filter(|(_, value)| !value.is_nan()) {
                    rows[*row] = value;
                }
                rows
            };
            for (signal, values) in clock.signals.drain(..) {
                columns[signal] = Some(placed(values));
            }
            condition = condition.or(clock.condition.take().map(placed));
        }
        self.chosen(merged.time, columns, condition)
    }

    /// The rows for which the mapping's `where` holds; its column keeps its value until the next.
    fn chosen(
        &mut self,
        time: Vec<f64>,
        columns: Vec<Option<Vec<f64>>>,
        condition: Option<Vec<f64>>,
    ) -> (Vec<f64>, Vec<Option<Vec<f64>>>) {
        let (Some(filter), Some(condition)) = (&self.mapping.filter, condition) else {
            return (time, columns);
        };
        let mut last = f64::NAN;
        let kept: Vec<bool> = condition
            .iter()
            .map(|value| {
                last = if value.is_nan() { last } else { *value };
                filter.keeps(last)
            })
            .collect();
        self.notes.not_chosen = kept.iter().filter(|kept| !**kept).count();
        let only = |values: Vec<f64>| -> Vec<f64> {
            values.into_iter().zip(&kept).filter(|(_, kept)| **kept).map(|(value, _)| value).collect()
        };
        let columns = columns.into_iter().map(|values| values.map(only)).collect();
        (only(time), columns)
    }
}

/// Change a second of `values` from the row before to the row behind; of the ends of a segment nobody knows any.
fn slopes(time: &[f64], values: &[f64], segments: &[Range<usize>]) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; values.len()];
    for segment in segments {
        for row in segment.start + 1..segment.end.saturating_sub(1) {
            // Where the row itself was not read, nobody knows that the neighbours belong together.
            let change = if values[row].is_nan() { f64::NAN } else { values[row + 1] - values[row - 1] };
            slopes[row] = change / (time[row + 1] - time[row - 1]);
        }
    }
    slopes
}

/// Moves values that a file has `rows` too late up to their own rows; of the last rows nobody knows any.
fn moved_up(values: &mut [f64], rows: usize) {
    let kept = values.len().saturating_sub(rows);
    values.rotate_left(values.len() - kept);
    values[kept..].fill(f64::NAN);
}
