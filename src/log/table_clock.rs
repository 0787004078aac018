//! The rows of one clock of a foreign log: those with a time, of one log, in rising time.

use std::path::Path;

use super::foreign_error::ForeignError;
use super::import_notes::Notes;
use super::tables::Table;
use super::thresholds::THRESHOLDS;

/// One clock of the file, with the signals that it carries.
pub(crate) struct Clock {
    /// Line of each row, for the notes.
    pub places: Vec<u64>,
    /// [s]
    pub time: Vec<f64>,
    /// Number of the signal in the mapping, and its values in SI.
    pub signals: Vec<(usize, Vec<f64>)>,
    /// Values of the column that says which rows count.
    pub condition: Option<Vec<f64>>,
    /// Whether it is the clock of the file, not of some of its columns.
    pub is_main: bool,
}

impl Clock {
    /// The clock of a table, without signals yet.
    pub(crate) fn of(table: &Table) -> Self {
        Self {
            places: (0..table.time.len()).map(|row| table.place(row)).collect(),
            time: table.time.clone(),
            signals: Vec::new(),
            condition: None,
            is_main: table.name.is_empty(),
        }
    }

    /// Only the rows of `kept`, in order.
    fn only(self, kept: &[usize]) -> Self {
        if kept.len() == self.time.len() {
            return self;
        }
        let pick = |values: &[f64]| kept.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        Self {
            places: kept.iter().map(|row| self.places[*row]).collect(),
            time: pick(&self.time),
            signals: self.signals.iter().map(|(signal, values)| (*signal, pick(values))).collect(),
            condition: self.condition.as_deref().map(pick),
            is_main: self.is_main,
        }
    }

    /// Without the rows that have no time.
    pub(crate) fn with_time(self, notes: &mut Notes) -> Self {
        let has_value = |row: usize| self.signals.iter().any(|(_, values)| !values[row].is_nan());
        let (kept, without): (Vec<usize>, Vec<usize>) =
            (0..self.time.len()).partition(|row| self.time[*row].is_finite());
        for row in without {
            // A clock of its own may end before the file does: such rows lack nothing.
            if self.is_main || has_value(row) {
                notes.without_time.add(self.places[row]);
            }
        }
        self.only(&kept)
    }

    /// The rows of one log: where time goes back and does not return, another one begins.
    pub(crate) fn part(
        self,
        path: &Path,
        part: Option<usize>,
        notes: &mut Notes,
    ) -> Result<Self, ForeignError> {
        let mut starts = vec![0];
        let mut latest = f64::NEG_INFINITY;
        for (index, time) in self.time.iter().enumerate() {
            let returns =
                || self.time[index..].iter().take(THRESHOLDS.restart_rows).any(|later| *later > latest);
            let is_restart =
                *time < latest && index + THRESHOLDS.restart_rows < self.time.len() && !returns();
            if is_restart {
                starts.push(index);
            }
            latest = if is_restart { *time } else { latest.max(*time) };
        }
        let parts = starts.len();
        let path = path.to_owned();
        match (part, starts.get(1)) {
            (None, None) => Ok(self),
            (None, Some(second)) => {
                let (before, after) = (self.time[second - 1], self.time[*second]);
                Err(ForeignError::Restart { path, line: self.places[*second], before, after, parts })
            }
            (Some(part), _) if (1..=parts).contains(&part) => {
                notes.part = Some((part, parts));
                let end = starts.get(part).copied().unwrap_or(self.time.len());
                let kept: Vec<usize> = (starts[part - 1]..end).collect();
                Ok(self.only(&kept))
            }
            (Some(part), _) => Err(ForeignError::Part { path, part, parts }),
        }
    }

    /// Rows with strictly rising time: equal stamps are merged, backward ones left out. What differs is counted of the first `counted`
    /// signals.
    pub(crate) fn in_rising_time(mut self, counted: usize, notes: &mut Notes) -> Self {
        let mut kept: Vec<usize> = Vec::with_capacity(self.time.len());
        for row in 0..self.time.len() {
            match kept.last().copied() {
                Some(last) if self.time[row] < self.time[last] => notes.backward_time.add(self.places[row]),
                Some(last) if self.time[row] == self.time[last] => {
                    notes.repeated_time.add(self.places[row]);
                    for (signal, values) in &mut self.signals {
                        let (mine, other) = (values[last], values[row]);
                        if mine.is_nan() {
                            values[last] = other;
                        } else if *signal < counted && !other.is_nan() && mine != other {
                            notes.conflicting_cells.add(self.places[row]);
                        }
                    }
                }
                _ => kept.push(row),
            }
        }
        self.only(&kept)
    }
}
