//! As many points as a picture has pixels: of each column of pixels the lowest and the highest sample, so that nothing that
//! could be seen is lost, however many rows the log has.
//!
//! All curves of one answer share one axis of slots in time. A slot without a sample of a curve is absent, and the curve goes
//! through; where it has none for longer than its sampling explains, there is a gap.

use std::cmp::Ordering;
use std::ops::Range;

use serde::Serialize;

use super::chunks::{ChunkSummary, Chunks, parted};
use super::thresholds::THRESHOLDS;
use crate::compare::SampleRows;
use crate::estimation::quantile::median_step;

/// Usual intervals over which a curve breaks: as the reports draw it.
const GAP: f64 = crate::report::thresholds::THRESHOLDS.drawn_gap;

/// A curve over the rows of a log.
pub(super) struct RowCurve<'a> {
    /// The rows that have a sample; `None`: every row has one.
    pub rows: Option<&'a SampleRows>,
    /// Value of a sample by its number and its row; not-a-number = none.
    pub value: Box<dyn Fn(usize, usize) -> f64 + 'a>,
    /// What was taken of it before; `None`: every sample is looked at.
    pub chunks: Option<&'a Chunks>,
}

impl RowCurve<'_> {
    /// Samples in rows before this one.
    fn before_row(&self, row: usize) -> usize {
        self.rows.map_or(row, |rows| rows.before_row(row))
    }

    /// The samples in these rows.
    fn samples(&self, rows: &Range<usize>) -> Range<usize> {
        self.before_row(rows.start)..self.before_row(rows.end)
    }

    /// Number, row and value of each of these samples.
    fn each(&self, samples: Range<usize>, mut hear: impl FnMut(usize, usize, f64)) {
        match self.rows {
            None => samples.for_each(|row| hear(row, row, (self.value)(row, row))),
            Some(rows) => {
                let each = samples.clone().zip(rows.between(samples));
                each.for_each(|(sample, row)| hear(sample, row, (self.value)(sample, row)));
            }
        }
    }

    /// What these samples hold.
    fn seen(&self, samples: Range<usize>) -> ChunkSummary {
        let mut seen = ChunkSummary::default();
        for part in parted(samples) {
            match self.chunks.and_then(|chunks| chunks.whole(&part)) {
                Some(known) => seen.join(known),
                None => self.each(part, |sample, _, value| seen.take(sample, value)),
            }
        }
        seen
    }

    /// Rows of the first of these samples that are numbers, so many at most.
    fn first_known(&self, samples: Range<usize>, most: usize) -> Vec<usize> {
        let mut known = Vec::new();
        for part in parted(samples) {
            if known.len() >= most {
                break;
            }
            if self.chunks.and_then(|chunks| chunks.whole(&part)).is_some_and(|seen| seen.samples == 0) {
                continue;
            }
            self.each(part, |_, row, value| known.extend(value.is_finite().then_some(row)));
        }
        known.truncate(most);
        known
    }
}

/// A curve, slot by slot.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct Drawn {
    /// Values; `None` where the slot has no sample. Single precision is finer than any pixel.
    pub y: Vec<Option<f32>>,
    /// Slots in which the curve is broken.
    pub gaps: Vec<usize>,
}

/// Every sample of a curve between two times, in the curve's unit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct RangeStatistics {
    pub samples: usize,
    /// The first sample's value, and the last one's.
    pub first: Option<f64>,
    pub last: Option<f64>,
    pub least: Option<f64>,
    pub greatest: Option<f64>,
    pub mean: Option<f64>,
    pub rms: Option<f64>,
}

impl From<ChunkSummary> for RangeStatistics {
    fn from(seen: ChunkSummary) -> Self {
        if seen.samples == 0 {
            return Self::default();
        }
        let count = seen.samples as f64;
        Self {
            samples: seen.samples,
            first: Some(seen.ends.0),
            last: Some(seen.ends.1),
            least: Some(seen.least.0),
            greatest: Some(seen.greatest.0),
            mean: Some(seen.sum / count),
            rms: Some((seen.squares / count).sqrt()),
        }
    }
}

/// The slots of a picture.
#[derive(Debug)]
pub(super) struct Slots<'a> {
    time: &'a [f64],
    /// [s] from where to where.
    span: (f64, f64),
    rows: Range<usize>,
    /// [s] of each slot.
    pub at: Vec<f64>,
    layout: Layout,
    interval: f64,
}

#[derive(Debug)]
enum Layout {
    /// First slot of each row, where each row has its own.
    Rows(Vec<usize>),
    /// Columns of pixels of this width [s], and the row that each begins with.
    Columns { width: f64, first_rows: Vec<usize> },
}

impl<'a> Slots<'a> {
    /// For the part of a log between two times, drawn over so many pixels. `interval` is its usual one [s].
    pub fn new(time: &'a [f64], (from, to): (f64, f64), pixels: usize, interval: f64) -> Self {
        let first = time.partition_point(|at| *at < from).saturating_sub(1);
        let last = (time.partition_point(|at| *at <= to) + 1).min(time.len());
        let rows = first.min(last)..last;
        let mut at = Vec::new();
        let seen = &time[rows.clone()];
        let layout = if seen.len() <= 2 * pixels {
            let mut slots = Vec::with_capacity(seen.len());
            for (index, now) in seen.iter().enumerate() {
                if index > 0 && now - seen[index - 1] > GAP * interval {
                    at.push(0.5 * (now + seen[index - 1]));
                }
                slots.push(at.len());
                at.push(*now);
            }
            Layout::Rows(slots)
        } else {
            let (start, end) = (seen[0], seen[seen.len() - 1]);
            let width = (end - start) / pixels as f64;
            for column in 0..pixels {
                at.extend([0.25, 0.75].map(|share| start + (column as f64 + share) * width));
            }
            let begin = |column: usize| {
                let from = start + column as f64 * width;
                rows.start + seen.partition_point(|time| *time < from)
            };
            Layout::Columns { width, first_rows: (0..pixels).map(begin).collect() }
        };
        Self { time, span: (from, to), rows, at, layout, interval }
    }

    /// The rows of the log that are seen.
    pub fn rows(&self) -> &Range<usize> {
        &self.rows
    }

    /// What a curve does between the two times: of every sample, not of those that are drawn.
    pub fn range(&self, line: &RowCurve) -> RangeStatistics {
        let (from, to) = self.span;
        let rows = self.time.partition_point(|at| *at < from)..self.time.partition_point(|at| *at <= to);
        line.seen(line.samples(&rows)).into()
    }

    /// A curve in these slots.
    pub fn draw(&self, line: &RowCurve) -> Drawn {
        let samples = line.samples(&self.rows);
        let y = match &self.layout {
            Layout::Rows(slots) => {
                let mut y = vec![None; self.at.len()];
                line.each(samples.clone(), |_, row, value| {
                    if let Some(slot) = slots.get(row - self.rows.start) {
                        y[*slot] = value.is_finite().then_some(value as f32);
                    }
                });
                y
            }
            Layout::Columns { first_rows, .. } => {
                let ends = first_rows.iter().skip(1).chain([&self.rows.end]);
                let columns = first_rows.iter().zip(ends);
                columns.flat_map(|(from, to)| pair(&line.seen(line.samples(&(*from..*to))))).collect()
            }
        };
        let known = line.first_known(samples, THRESHOLDS.looked_at);
        let usual = median_step(known.iter().map(|row| self.time[*row]));
        let gaps = self.gaps(&y, usual.unwrap_or(0.0));
        Drawn { y, gaps }
    }

    /// Slots behind the last sample before a stretch without any.
    fn gaps(&self, y: &[Option<f32>], usual: f64) -> Vec<usize> {
        let width = if let Layout::Columns { width, .. } = self.layout { width } else { 0.0 };
        let longest = GAP * usual.max(self.interval).max(width);
        let mut gaps = Vec::new();
        let mut before: Option<usize> = None;
        for slot in (0..y.len()).filter(|slot| y[*slot].is_some()) {
            if let Some(before) = before.filter(|before| self.at[slot] - self.at[*before] > longest)
                && before + 1 < slot
            {
                gaps.push(before + 1);
            }
            before = Some(slot);
        }
        gaps
    }
}

/// The extremes of one column of pixels, in the order in which they came; a single sample stands alone.
fn pair(seen: &ChunkSummary) -> [Option<f32>; 2] {
    let ((low, first), (high, second)) = (seen.least, seen.greatest);
    let of = |value: f64| (seen.samples > 0).then_some(value as f32);
    match first.cmp(&second) {
        Ordering::Less => [of(low), of(high)],
        Ordering::Greater => [of(high), of(low)],
        Ordering::Equal => [of(low), None],
    }
}

/// [s] begin and end of the stretch in which the mean squared error is largest; `None` without an error.
pub(super) fn worst_stretch(time: &[f64], error: impl Fn(usize) -> f64) -> Option<(f64, f64)> {
    let length = THRESHOLDS.worst_stretch_s;
    let (mut first, mut sum, mut worst) = (0, 0.0, None::<(f64, f64)>);
    let square = |sample: usize| Some(error(sample).powi(2)).filter(|it| it.is_finite()).unwrap_or(0.0);
    for last in 0..time.len() {
        sum += square(last);
        while time[last] - time[first] > length {
            sum -= square(first);
            first += 1;
        }
        if worst.is_none_or(|(largest, _)| sum > largest) {
            worst = Some((sum, time[first]));
        }
    }
    let (sum, from) = worst?;
    let end = time.last().copied()?;
    let from = from.min((end - length).max(time[0]));
    (sum > 0.0).then(|| (from, (from + length).min(end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(values: &[f64]) -> RowCurve<'_> {
        RowCurve { rows: None, value: Box::new(|_, row| values[row]), chunks: None }
    }

    #[test]
    fn a_single_spike_among_a_million_rows_is_seen() {
        let time: Vec<f64> = (0..1_000_000).map(|row| 0.001 * f64::from(row)).collect();
        let mut values = vec![0.0; time.len()];
        (values[333_333], values[777_777]) = (5.0, -5.0);
        let slots = Slots::new(&time, (0.0, 1000.0), 800, 0.001);
        let drawn = slots.draw(&line(&values));
        assert_eq!(drawn.y.len(), 1600);
        let seen = |value: f32| drawn.y.iter().filter(|y| **y == Some(value)).count();
        assert_eq!((seen(5.0), seen(-5.0)), (1, 1));
        assert!(drawn.gaps.is_empty());
        let rising = |pair: &[f64]| pair[0] < pair[1];
        assert!(slots.at.windows(2).all(rising));
    }

    #[test]
    fn a_hole_and_a_dropout_break_the_curve_and_a_slow_sensor_does_not() {
        // A hole between 1.0 and 2.0 s; a sensor in every fourth row, without readings from 3 to 4 s.
        let time: Vec<f64> = (0..500).map(|row| 0.01 * f64::from(row)).collect();
        let time: Vec<f64> = time.into_iter().filter(|at| !(1.005..2.0).contains(at)).collect();
        let values: Vec<f64> = time
            .iter()
            .enumerate()
            .map(|(row, at)| if row % 4 == 0 && !(3.0..4.0).contains(at) { *at } else { f64::NAN })
            .collect();
        for pixels in [1000, 100] {
            let slots = Slots::new(&time, (0.0, 5.0), pixels, 0.01);
            let gaps = slots.draw(&line(&values)).gaps;
            assert_eq!(gaps.len(), 2, "{pixels} pixels: {gaps:?}");
            assert!((0.95..2.0).contains(&slots.at[gaps[0]]) && (2.9..4.0).contains(&slots.at[gaps[1]]));
        }
    }

    #[test]
    fn a_range_counts_every_sample_between_its_ends_and_none_beside_them() {
        let time: Vec<f64> = (0..10_000).map(|row| 0.01 * f64::from(row)).collect();
        let mut values: Vec<f64> = (0..10_000).map(|row| if row % 2 == 0 { 1.0 } else { 3.0 }).collect();
        (values[99], values[100], values[301]) = (1e9, f64::NAN, 1e9);
        let range = Slots::new(&time, (1.0, 3.0), 1, 0.01).range(&line(&values));
        let expected = RangeStatistics {
            samples: 200,
            first: Some(3.0),
            last: Some(1.0),
            least: Some(1.0),
            greatest: Some(3.0),
            mean: Some(2.0),
            rms: Some(5.0_f64.sqrt()),
        };
        assert_eq!(range, expected);
        assert_eq!(Slots::new(&time, (500.0, 600.0), 1, 0.01).range(&line(&values)).samples, 0);
    }

    /// What was taken once says the same as every sample looked at anew, of rows that all have one and of some of them.
    #[test]
    fn chunks_change_nothing_of_a_picture() {
        let time: Vec<f64> = (0..20_000).map(|row| 0.01 * f64::from(row)).collect();
        // Whole numbers: sums are the same in whatever order. A stretch of several chunks without a reading.
        let value = |row: usize| match row % 3 == 1 || (6_000..9_000).contains(&row) {
            true => f64::NAN,
            false => (row * 7_919 % 1_009) as f64,
        };
        let rows = SampleRows::of(vec![3..5_000, 5_001..12_345, 12_400..19_990]);
        for rows in [None, Some(&rows)] {
            let count = rows.map_or(time.len(), SampleRows::len);
            let own_rows = || rows.map_or((0..count).collect::<Vec<_>>(), |rows| rows.iter().collect());
            let chunks = Chunks::of(own_rows().into_iter().map(value));
            let line = |chunks| RowCurve { rows, value: Box::new(move |_, row| value(row)), chunks };
            for (span, pixels) in
                [((0.0, 200.0), 100), ((0.0, 200.0), 7), ((31.0, 158.0), 333), ((55.0, 95.0), 2)]
            {
                let slots = Slots::new(&time, span, pixels, 0.01);
                let (anew, known) = (line(None), line(Some(&chunks)));
                assert_eq!(slots.draw(&known), slots.draw(&anew), "{span:?}");
                assert_eq!(slots.range(&known), slots.range(&anew), "{span:?}");
            }
        }
    }

    #[test]
    fn what_is_seen_is_what_was_asked_for_and_one_row_beside_it() {
        let time: Vec<f64> = (0..1000).map(|row| 0.01 * f64::from(row)).collect();
        let slots = Slots::new(&time, (2.0, 3.0), 800, 0.01);
        assert_eq!(*slots.rows(), 199..302);
        let rows = SampleRows::of((0..1000).step_by(2).map(|row| row..row + 1).collect());
        let half = RowCurve { rows: Some(&rows), value: Box::new(|sample, _| sample as f64), chunks: None };
        let drawn = slots.draw(&half);
        assert_eq!(drawn.y[..3], [None, Some(100.0), None], "samples by their own rows");
        assert!(Slots::new(&time, (50.0, 60.0), 800, 0.01).at.len() <= 1, "nothing there");
    }

    #[test]
    fn the_worst_ten_seconds_hold_the_error() {
        let time: Vec<f64> = (0..6000).map(|row| 0.01 * f64::from(row)).collect();
        let error = |row: usize| if (3000..3500).contains(&row) { 1.0 } else { 0.01 };
        let (from, to) = worst_stretch(&time, error).expect("an error");
        // The last row with an error is at 34.99 s.
        assert!(from <= 30.0 && to >= 34.99 && to - from <= 10.0, "{from} to {to}");
        assert_eq!(worst_stretch(&time, |_| 0.0), None);
        assert_eq!(worst_stretch(&time[..100], |_| 1.0), Some((0.0, 0.99)), "a short log is shown whole");
    }
}
