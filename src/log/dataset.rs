//! A log in memory: time, and columns by their log-format names. Missing cells are not-a-number, holes in
//! time are known, and nothing here ever interpolates across one.

use std::ops::Range;

use super::thresholds::THRESHOLDS;
use crate::cells::Cells;
use crate::estimation::quantile::median_step;
use crate::signal::columns;

/// [s] to the nanosecond: what is finer is the rounding of a sum.
pub(crate) fn nanoseconds(time: f64) -> f64 {
    (1e9 * time).round() / 1e9
}

/// Why a dataset cannot be what was asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DatasetError {
    /// Time stops, goes back, or is not a number.
    #[error(
        "{source_name}: time goes from {} s to {} s at sample {row}; it must rise (`import` leaves out rows that go back, and says which)",
        nanoseconds(*before), nanoseconds(*after)
    )]
    Time {
        /// File or other origin.
        source_name: String,
        /// Sample, from 1.
        row: usize,
        /// [s]
        before: f64,
        /// [s]
        after: f64,
    },
    /// A column has another length than time has.
    #[error("{source_name}: column `{column}` has {found} values for {expected} samples")]
    Length {
        /// File or other origin.
        source_name: String,
        /// Name of the column.
        column: String,
        /// Values in it.
        found: usize,
        /// Samples of time.
        expected: usize,
    },
    /// Two columns have the same name.
    #[error("{source_name}: column `{column}` is there twice")]
    Duplicate {
        /// File or other origin.
        source_name: String,
        /// Name of the column.
        column: String,
    },
}

/// A gap in time over which nothing is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// Sample after which it begins.
    pub after: usize,
    /// [s] when it begins.
    pub start: f64,
    /// [s] how long it is.
    pub length: f64,
}

/// A log: rising time and named columns of the same length. Its copies share the columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    source_name: String,
    sha256: String,
    time: Cells,
    /// [s] median sampling interval: asked for often.
    interval: f64,
    columns: Vec<(String, Cells)>,
    /// Name of the format of another program that it came in; empty where it came in none.
    format: &'static str,
}

impl Dataset {
    /// A log of `time` [s] without columns yet. `source_name` appears in messages and in the model's ladder,
    /// `sha256` is the content hash of the file (empty when there is no file).
    ///
    /// # Errors
    /// [`DatasetError::Time`] when time does not rise strictly.
    pub fn new(
        source_name: impl Into<String>,
        sha256: impl Into<String>,
        time: Vec<f64>,
    ) -> Result<Self, DatasetError> {
        let source_name = source_name.into();
        if let Some(first) = time.first().filter(|first| !first.is_finite()) {
            return Err(DatasetError::Time { source_name, row: 1, before: f64::NAN, after: *first });
        }
        for (index, pair) in time.windows(2).enumerate() {
            // Written so that not-a-number is refused too.
            if !(pair[1] > pair[0] && pair[1].is_finite()) {
                return Err(DatasetError::Time {
                    source_name,
                    row: index + 2,
                    before: pair[0],
                    after: pair[1],
                });
            }
        }
        let interval = median_step(time.iter().copied()).unwrap_or(0.0);
        let (sha256, time) = (sha256.into(), time.into());
        Ok(Self { source_name, sha256, time, interval, columns: Vec::new(), format: "" })
    }

    /// The same, of the format of another program.
    #[must_use]
    pub(crate) fn of_format(self, format: &'static str) -> Self {
        Self { format, ..self }
    }

    /// Name of the format of another program that it came in, as a flight controller's; empty where it came in none.
    #[must_use]
    pub fn format(&self) -> &'static str {
        self.format
    }

    /// Adds a column.
    ///
    /// # Errors
    /// [`DatasetError`] when its length is not that of time, or its name is taken.
    pub fn insert(&mut self, name: impl Into<String>, values: Vec<f64>) -> Result<(), DatasetError> {
        let column = name.into();
        let source_name = self.source_name.clone();
        if values.len() != self.time.len() {
            let (found, expected) = (values.len(), self.time.len());
            return Err(DatasetError::Length { source_name, column, found, expected });
        }
        if column == columns::TIME || self.columns.iter().any(|(name, _)| *name == column) {
            return Err(DatasetError::Duplicate { source_name, column });
        }
        self.columns.push((column, values.into()));
        Ok(())
    }

    /// Replaces the values of a column that is there, or adds it.
    ///
    /// # Errors
    /// [`DatasetError::Length`] when the length is not that of time.
    pub fn replace(&mut self, name: &str, values: Vec<f64>) -> Result<(), DatasetError> {
        self.columns.retain(|(column, _)| column != name);
        self.insert(name, values)
    }

    /// Where it came from: a file name, or a few words.
    #[must_use]
    pub fn source_name(&self) -> &str {
        &self.source_name
    }

    /// SHA-256 of the file's bytes in hexadecimal; empty when there is no file.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// [s] time of each sample.
    #[must_use]
    pub fn time(&self) -> &[f64] {
        &self.time
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// Names of the columns, time apart, in the file's order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|(name, _)| name.as_str())
    }

    /// Values of a column; not-a-number = missing cell. `None` when it is absent or has no value at all.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let (_, values) = self.columns.iter().find(|(column, _)| column == name)?;
        values.has_any().then_some(&values[..])
    }

    /// Whether it has a value in this column.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.columns.iter().any(|(column, values)| column == name && values.has_any())
    }

    /// The same, shared with who holds it.
    #[must_use]
    pub fn cells(&self, name: &str) -> Option<Cells> {
        let (_, values) = self.columns.iter().find(|(column, _)| column == name)?;
        values.has_any().then(|| values.clone())
    }

    /// Keeps of long columns that are hardly ever measured, and that only this log and its `copy` hold, what was measured: of a log
    /// that was judged nobody asks for them often.
    pub(crate) fn keep_few(&mut self, mut copy: Option<&mut Self>) {
        for (name, cells) in &mut self.columns {
            let columns = copy.as_mut().and_then(|copy| copy.columns.iter_mut().find(|(it, _)| it == name));
            let same = columns.map(|(_, it)| it).filter(|it| it.is_same(cells));
            if cells.keep_few(1 + usize::from(same.is_some()))
                && let Some(same) = same
            {
                same.clone_from(cells);
            }
        }
    }

    /// [s] time of each sample, shared with who holds it.
    #[must_use]
    pub fn time_cells(&self) -> Cells {
        self.time.clone()
    }

    /// [s] median sampling interval; 0 with fewer than two samples.
    #[must_use]
    pub fn median_interval(&self) -> f64 {
        self.interval
    }

    /// The gaps in time that are longer than 2.5 median sampling intervals.
    #[must_use]
    pub fn holes(&self) -> Vec<Hole> {
        let gaps = self.time.windows(2).enumerate().map(|(after, pair)| (after, pair[0], pair[1] - pair[0]));
        gaps.filter(|(_, _, length)| is_hole(*length, self.interval))
            .map(|(after, start, length)| Hole { after, start, length })
            .collect()
    }

    /// The segments: rows without a hole between them.
    #[must_use]
    pub fn segments(&self) -> Vec<Range<usize>> {
        let mut segments = Vec::new();
        let mut start = 0;
        for hole in self.holes() {
            segments.push(start..hole.after + 1);
            start = hole.after + 1;
        }
        if start < self.len() {
            segments.push(start..self.len());
        }
        segments
    }

    /// The log with the columns under other names; those that `name` gives none are left out.
    #[must_use]
    pub fn renamed(self, name: impl Fn(&str) -> Option<String>) -> Self {
        let columns = self.columns.into_iter();
        let columns =
            columns.filter_map(|(column, values)| name(&column).map(|name| (name, values))).collect();
        Self { columns, ..self }
    }

    /// A log with only the columns that `keeps` says yes to.
    #[must_use]
    pub fn with_columns(&self, keeps: impl Fn(&str) -> bool) -> Self {
        Self {
            source_name: self.source_name.clone(),
            sha256: self.sha256.clone(),
            time: self.time.clone(),
            interval: self.interval,
            columns: self.columns.iter().filter(|(name, _)| keeps(name)).cloned().collect(),
            format: self.format,
        }
    }

    /// The samples of these stretches of rows, one behind the other, as a log of their own: what lies between them is a hole.
    #[must_use]
    pub fn of_rows(&self, stretches: &[Range<usize>]) -> Self {
        let cut = |values: &Cells| -> Cells {
            let values = values.for_once();
            stretches.iter().flat_map(|rows| &values[rows.clone()]).copied().collect()
        };
        let columns = self.columns.iter().map(|(name, values)| (name.clone(), cut(values)));
        Self {
            source_name: self.source_name.clone(),
            sha256: self.sha256.clone(),
            time: cut(&self.time),
            interval: self.interval,
            columns: columns.collect(),
            format: self.format,
        }
    }

    /// The samples of `rows` (clipped to what is there) as a log of their own.
    #[must_use]
    pub fn slice(&self, rows: Range<usize>) -> Self {
        let end = rows.end.min(self.len());
        let rows = rows.start.min(end)..end;
        let columns = self.columns.iter().map(|(name, values)| (name.clone(), values.part(rows.clone())));
        Self {
            source_name: self.source_name.clone(),
            sha256: self.sha256.clone(),
            time: self.time.part(rows.clone()),
            interval: median_step(self.time[rows.clone()].iter().copied()).unwrap_or(0.0),
            columns: columns.collect(),
            format: self.format,
        }
    }
}

/// Whether a log with this median interval [s] has a hole where two rows are `gap` [s] apart.
#[must_use]
pub fn is_hole(gap: f64, median_interval: f64) -> bool {
    gap > THRESHOLDS.hole * median_interval
}

#[cfg(test)]
impl Dataset {
    /// A log of these columns.
    pub(crate) fn made<const N: usize>(time: Vec<f64>, columns: [(&str, Vec<f64>); N]) -> Self {
        let mut log = Self::new("here", "", time).expect("time rises");
        columns.into_iter().for_each(|(name, values)| log.insert(name, values).expect("as long as time"));
        log
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_part_the_log_and_jitter_does_not() {
        let log = Dataset::new("here", "", vec![0.0, 1.0, 2.1, 3.0, 5.0, 9.0, 10.0]).expect("time rises");
        assert_eq!(log.holes(), [Hole { after: 4, start: 5.0, length: 4.0 }]);
        assert_eq!(log.segments(), [0..5, 5..7]);
        assert_eq!(log.slice(5..99).time(), [9.0, 10.0]);
    }

    /// A long log whose battery is read once in ten rows, and what is left of it when its cells were cleaned.
    #[test]
    fn a_log_and_its_copy_keep_the_same_few_cells() {
        let rows = 0..Cells::LONG;
        let volts = rows.clone().map(|row| if row % 10 == 3 { 12.0 } else { f64::NAN }).collect();
        let time = rows.map(|row| 1e-3 * row as f64).collect();
        let mut log = Dataset::made(time, [("battery_voltage_v", volts)]);
        log.insert("current_1_a", vec![f64::NAN; Cells::LONG]).expect("as long as time");
        let whole = log.clone();
        log.keep_few(None);
        assert!(log.cells("battery_voltage_v").is_some_and(|it| whole.columns[0].1.is_same(&it)), "held");
        drop(whole);
        let mut copy = log.clone();
        log.keep_few(Some(&mut copy));
        assert!(log.columns[0].1.is_same(&copy.columns[0].1));
        assert_eq!(
            (log.has("battery_voltage_v"), log.has("current_1_a"), log.has("x")),
            (true, false, false)
        );
        assert_eq!(log.column("current_1_a"), None);
        let part = log.of_rows(&[0..5, 10..14]);
        assert_eq!(
            part.column("battery_voltage_v").map(|it| (it.len(), it[3], it[8])),
            Some((9, 12.0, 12.0))
        );
    }

    #[test]
    fn refuses_what_cannot_be_a_log() {
        assert_eq!(
            Dataset::new("a.csv", "", vec![0.0, 1.0, 1.0]).unwrap_err().to_string(),
            "a.csv: time goes from 1 s to 1 s at sample 3; it must rise (`import` leaves out rows that go back, and says which)"
        );
        let rounded =
            Dataset::new("a.csv", "", vec![0.1 + 0.2, 3.552_713_678_800_501e-15]).unwrap_err().to_string();
        assert!(rounded.contains("time goes from 0.3 s to 0 s"), "{rounded}");
        assert!(Dataset::new("a.csv", "", vec![0.0, f64::NAN]).is_err());
        assert!(Dataset::new("a.csv", "", vec![f64::NAN]).is_err());
        let mut log = Dataset::new("a.csv", "", vec![0.0, 1.0]).expect("time rises");
        log.insert("command_1", vec![0.1, 0.2]).expect("right length");
        assert!(log.insert("command_1", vec![0.1, 0.2]).is_err());
        assert!(log.insert("time_s", vec![0.1, 0.2]).is_err());
        assert!(log.insert("command_2", vec![0.1]).is_err());
        log.insert("current_1_a", vec![f64::NAN; 2]).expect("right length");
        assert_eq!(log.column("current_1_a"), None);
    }
}
