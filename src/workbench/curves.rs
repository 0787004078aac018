//! As many points as a picture has pixels: of each column of pixels the lowest and the highest sample, so that nothing that
//! could be seen is lost, however many rows the log has.
//!
//! All curves of one answer share one axis of slots in time. A slot without a sample of a curve is absent, and the curve goes
//! through; where it has none for longer than its sampling explains, there is a gap.

use std::ops::Range;

use serde::Serialize;

use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::median_step;

/// Usual intervals over which a curve breaks: as the reports draw it.
const GAP: f64 = crate::report::thresholds::THRESHOLDS.drawn_gap;

/// A curve over the rows of a log.
pub(super) struct Line<'a> {
    /// The row of each sample, ascending; `None`: every row has one.
    pub rows: Option<&'a [usize]>,
    /// Value of a sample by its number; not-a-number = none.
    pub value: Box<dyn Fn(usize) -> f64 + 'a>,
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

impl RangeStatistics {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut all, mut sum, mut squares) = (Self::default(), 0.0, 0.0);
        for value in values.filter(|value| value.is_finite()) {
            all.samples += 1;
            all.first = all.first.or(Some(value));
            all.last = Some(value);
            all.least = Some(all.least.map_or(value, |least| least.min(value)));
            all.greatest = Some(all.greatest.map_or(value, |greatest| greatest.max(value)));
            sum += value;
            squares += value * value;
        }
        if all.samples > 0 {
            let count = all.samples as f64;
            (all.mean, all.rms) = (Some(sum / count), Some((squares / count).sqrt()));
        }
        all
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
    /// First slot of each row, where each row has its own; else columns of pixels of this width [s].
    layout: Layout,
    interval: f64,
}

#[derive(Debug)]
enum Layout {
    Rows(Vec<usize>),
    Columns { start: f64, width: f64, count: usize },
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
            Layout::Columns { start, width, count: pixels }
        };
        Self { time, span: (from, to), rows, at, layout, interval }
    }

    /// The rows of the log that are seen.
    pub fn rows(&self) -> &Range<usize> {
        &self.rows
    }

    /// The samples of a curve in the rows that are seen.
    fn samples(&self, line: &Line) -> Range<usize> {
        let Some(rows) = line.rows else { return self.rows.clone() };
        rows.partition_point(|row| *row < self.rows.start)..rows.partition_point(|row| *row < self.rows.end)
    }

    /// What a curve does between the two times: of every sample, not of those that are drawn.
    pub fn range(&self, line: &Line) -> RangeStatistics {
        let at = |sample: usize| self.time[line.rows.map_or(sample, |rows| rows[sample])];
        let within = self.samples(line).filter(|sample| (self.span.0..=self.span.1).contains(&at(*sample)));
        RangeStatistics::of(within.map(|sample| (line.value)(sample)))
    }

    /// A curve in these slots.
    pub fn draw(&self, line: &Line) -> Drawn {
        let samples = self.samples(line);
        let row_of = |sample: usize| line.rows.map_or(sample, |rows| rows[sample]);
        let y = match &self.layout {
            Layout::Rows(slots) => {
                let mut y = vec![None; self.at.len()];
                for sample in samples.clone() {
                    let value = (line.value)(sample);
                    if let Some(slot) = slots.get(row_of(sample) - self.rows.start) {
                        y[*slot] = value.is_finite().then_some(value as f32);
                    }
                }
                y
            }
            Layout::Columns { start, width, count } => {
                let mut columns = vec![Column::default(); *count];
                for sample in samples.clone() {
                    let value = (line.value)(sample);
                    let column = ((self.time[row_of(sample)] - start) / width) as usize;
                    if value.is_finite()
                        && let Some(column) = columns.get_mut(column.min(count - 1))
                    {
                        column.take(value as f32, sample);
                    }
                }
                columns.iter().flat_map(Column::pair).collect()
            }
        };
        let present = samples.filter(|sample| (line.value)(*sample).is_finite()).take(THRESHOLDS.looked_at);
        let present: Vec<f64> = present.map(|sample| self.time[row_of(sample)]).collect();
        let usual = median_step(present).unwrap_or(0.0);
        let gaps = self.gaps(&y, usual);
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

/// The extremes of one column of pixels, and the samples that they are.
#[derive(Debug, Clone, Copy, Default)]
struct Column {
    low: Option<(f32, usize)>,
    high: Option<(f32, usize)>,
}

impl Column {
    fn take(&mut self, value: f32, sample: usize) {
        if self.low.is_none_or(|(low, _)| value < low) {
            self.low = Some((value, sample));
        }
        if self.high.is_none_or(|(high, _)| value > high) {
            self.high = Some((value, sample));
        }
    }

    /// Both in the order in which they came; a single sample stands alone.
    fn pair(&self) -> [Option<f32>; 2] {
        match (self.low, self.high) {
            (Some((low, first)), Some((high, second))) if first < second => [Some(low), Some(high)],
            (Some((low, first)), Some((high, second))) if first > second => [Some(high), Some(low)],
            (Some((low, _)), _) => [Some(low), None],
            _ => [None, None],
        }
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

    fn line(values: &[f64]) -> Line<'_> {
        Line { rows: None, value: Box::new(|row| values[row]) }
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

    #[test]
    fn what_is_seen_is_what_was_asked_for_and_one_row_beside_it() {
        let time: Vec<f64> = (0..1000).map(|row| 0.01 * f64::from(row)).collect();
        let slots = Slots::new(&time, (2.0, 3.0), 800, 0.01);
        assert_eq!(*slots.rows(), 199..302);
        let rows: Vec<usize> = (0..1000).step_by(2).collect();
        let half = Line { rows: Some(&rows), value: Box::new(|sample| sample as f64) };
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
