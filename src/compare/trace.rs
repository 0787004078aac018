//! Signals of a comparison, sample by sample. What the log has itself is shared with it: of a long log copies would take more
//! memory than the log.

use std::borrow::Cow;
use std::ops::Range;

use super::dependence::at_rows;
use crate::log::Cells;

/// The rows of a log that have a sample of a signal, in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SampleRows {
    ranges: Vec<Range<usize>>,
    /// Samples before each range.
    before: Vec<usize>,
    samples: usize,
}

impl SampleRows {
    /// Rows that ascend.
    pub(crate) fn of(ranges: Vec<Range<usize>>) -> Self {
        let mut samples = 0;
        let mut before = Vec::with_capacity(ranges.len());
        for rows in &ranges {
            before.push(samples);
            samples += rows.len();
        }
        Self { ranges, before, samples }
    }

    /// How many samples there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// Row of each sample.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.between(0..self.samples)
    }

    /// Row of each of these samples.
    pub fn between(&self, samples: Range<usize>) -> impl Iterator<Item = usize> + '_ {
        let at = self.before.partition_point(|before| *before <= samples.start).saturating_sub(1);
        let skipped = self.before.get(at).map_or(0, |before| samples.start.saturating_sub(*before));
        let (first, rest) = match self.ranges.get(at..) {
            Some([first, rest @ ..]) => (first.start + skipped..first.end, rest),
            _ => (0..0, &[][..]),
        };
        first.chain(rest.iter().flat_map(Clone::clone)).take(samples.len())
    }

    /// How many samples lie in rows before this one.
    #[must_use]
    pub fn before_row(&self, row: usize) -> usize {
        let behind = self.ranges.partition_point(|rows| rows.start < row);
        let Some(last) = behind.checked_sub(1) else { return 0 };
        self.before[last] + row.min(self.ranges[last].end) - self.ranges[last].start
    }

    /// A column of the log in these rows.
    #[must_use]
    pub fn values<'a>(&self, column: &'a [f64]) -> Cow<'a, [f64]> {
        at_rows(column, &self.ranges)
    }
}

/// Measured and modelled signal, sample by sample; empty where [`CompareConfig::signals`](super::CompareConfig) says so.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    pub(crate) rows: SampleRows,
    /// [s] of each row of the log.
    pub(crate) time: Cells,
    pub(crate) measured: MeasuredSignal,
    /// In the signal's unit, of each sample.
    pub(crate) modelled: Cells,
    /// Which of what was measured is scored; `None` = all of it.
    pub(crate) in_part: Option<Vec<bool>>,
}

/// What was measured, in the signal's unit; not-a-number = not measured.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MeasuredSignal {
    /// In each row of the log.
    Column(Cells),
    /// In each sample: made of the log's columns.
    Own(Cells),
}

impl Default for MeasuredSignal {
    fn default() -> Self {
        Self::Own(Cells::default())
    }
}

impl Trace {
    /// Rows of the log that have a sample.
    #[must_use]
    pub fn rows(&self) -> &SampleRows {
        &self.rows
    }

    /// [s] of each sample.
    #[must_use]
    pub fn time(&self) -> Cow<'_, [f64]> {
        self.rows.values(&self.time)
    }

    /// In the signal's unit; not-a-number = not measured.
    #[must_use]
    pub fn measured(&self) -> Cow<'_, [f64]> {
        match &self.measured {
            MeasuredSignal::Column(column) => self.rows.values(column),
            MeasuredSignal::Own(values) => Cow::Borrowed(values),
        }
    }

    /// In the signal's unit.
    #[must_use]
    pub fn modelled(&self) -> &[f64] {
        &self.modelled
    }

    /// What was measured at a sample, which is of this row; not-a-number = not measured.
    #[must_use]
    pub fn measured_at(&self, sample: usize, row: usize) -> f64 {
        match &self.measured {
            MeasuredSignal::Column(column) => column[row],
            MeasuredSignal::Own(values) => values[sample],
        }
    }

    /// Measured minus modelled at a sample, which is of this row; not-a-number where it is not scored.
    #[must_use]
    pub fn residual_at(&self, sample: usize, row: usize) -> f64 {
        match &self.in_part {
            Some(in_part) if !in_part[sample] => f64::NAN,
            _ => self.measured_at(sample, row) - self.modelled[sample],
        }
    }

    /// Measured minus modelled, in the signal's unit; not-a-number where it is not scored.
    #[must_use]
    pub fn residual(&self) -> Vec<f64> {
        self.rows.iter().enumerate().map(|(sample, row)| self.residual_at(sample, row)).collect()
    }

    /// Whether each sample is scored: it is measured, and the block is asked for it.
    pub fn is_scored(&self) -> impl Iterator<Item = bool> + '_ {
        self.rows.iter().enumerate().map(|(sample, row)| {
            self.in_part.as_ref().is_none_or(|in_part| in_part[sample])
                && self.measured_at(sample, row).is_finite()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_and_rows_find_each_other() {
        let rows = SampleRows::of(vec![2..4, 4..6, 9..12]);
        assert_eq!((rows.len(), rows.iter().collect::<Vec<_>>()), (7, vec![2, 3, 4, 5, 9, 10, 11]));
        for from in 0..=7 {
            for to in from..=7 {
                let all: Vec<usize> = rows.iter().skip(from).take(to - from).collect();
                assert_eq!(rows.between(from..to).collect::<Vec<_>>(), all, "{from} to {to}");
            }
        }
        for row in 0..15 {
            assert_eq!(rows.before_row(row), rows.iter().filter(|it| *it < row).count(), "row {row}");
        }
        assert!(SampleRows::default().is_empty() && SampleRows::default().before_row(3) == 0);
    }

    #[test]
    fn only_what_is_scored_has_a_residual() {
        let trace = Trace {
            rows: SampleRows::of(vec![1..3, 3..4]),
            time: vec![0.0, 0.1, 0.2, 0.3].into(),
            measured: MeasuredSignal::Column(vec![9.0, 1.0, f64::NAN, 3.0].into()),
            modelled: vec![0.5, 0.5, 0.5].into(),
            in_part: Some(vec![false, true, true]),
        };
        assert_eq!(trace.is_scored().collect::<Vec<_>>(), [false, false, true]);
        let residual = trace.residual();
        assert!(residual[0].is_nan() && residual[1].is_nan() && residual[2] == 2.5);
        assert_eq!((&trace.time()[..], trace.measured()[0]), (&[0.1, 0.2, 0.3][..], 1.0));
    }
}
