//! Short gaps of a channel bridged by straight lines, for what the channel drives.

use std::borrow::Cow;

use super::thresholds::THRESHOLDS;
use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::median_step;

/// The channel with straight lines over missing cells, where its readings come at an interval and only a few are missing. For
/// what a channel drives; nothing is judged by what lies on such a line. A channel without gaps is not copied.
#[must_use]
pub fn bridged<'a>(time: &[f64], values: &'a [f64]) -> Cow<'a, [f64]> {
    let Some(readings) = Readings::of(time, values) else { return Cow::Borrowed(values) };
    readings.bridged(time, values).into()
}

/// The readings of a channel that has gaps.
struct Readings {
    /// Their rows.
    known: Vec<usize>,
    /// [s] from one to the next; `None` where there are not two.
    interval: Option<f64>,
}

impl Readings {
    /// `None` of a channel without gaps.
    fn of(time: &[f64], values: &[f64]) -> Option<Self> {
        if values.iter().all(|value| value.is_finite()) {
            return None;
        }
        let known: Vec<usize> = finite_rows(values, 0..values.len());
        let interval = median_step(known.iter().map(|row| time[*row]));
        Some(Self { known, interval })
    }

    fn bridged(&self, time: &[f64], values: &[f64]) -> Vec<f64> {
        let mut bridged = values.to_vec();
        let Some(interval) = self.interval else { return bridged };
        for pair in self.known.windows(2).filter(|pair| pair[1] > pair[0] + 1) {
            let (from, to) = (pair[0], pair[1]);
            let span = time[to] - time[from];
            if span > THRESHOLDS.bridged * interval {
                continue;
            }
            for row in from + 1..to {
                bridged[row] = values[from] + (values[to] - values[from]) * (time[row] - time[from]) / span;
            }
        }
        bridged
    }
}

/// The same, and on either side of each gap that is too long for a line, and of the log, the nearest reading for as long as one
/// usually stands until the next: where readings come with every fourth row, the first three rows have one, too.
#[must_use]
pub fn carried<'a>(time: &[f64], values: &'a [f64]) -> Cow<'a, [f64]> {
    let Some(readings) = Readings::of(time, values) else { return Cow::Borrowed(values) };
    let mut carried = readings.bridged(time, values);
    let Some(interval) = readings.interval else { return carried.into() };
    // Half a row less: a reading of every row stands for its own.
    let rows = median_step(time.iter().copied()).unwrap_or(0.0);
    let stands = interval - 0.5 * rows;
    for row in readings.known {
        for behind in (row + 1..values.len()).take_while(|at| time[*at] - time[row] <= stands) {
            if carried[behind].is_finite() {
                break;
            }
            carried[behind] = values[row];
        }
        for before in (0..row).rev().take_while(|at| time[row] - time[*at] <= stands) {
            if carried[before].is_finite() {
                break;
            }
            carried[before] = values[row];
        }
    }
    carried.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_stands_until_the_next_one_is_due() {
        let time: Vec<f64> = (0..60).map(|row| 0.01 * f64::from(row)).collect();
        let is_read = |row: usize| row % 4 == 3 && !(20..48).contains(&row);
        let values: Vec<f64> = (0..60).map(|row| if is_read(row) { row as f64 } else { f64::NAN }).collect();
        let carried = carried(&time, &values);
        assert_eq!(carried[..4], [3.0; 4]);
        assert_eq!((carried[5], carried[19]), (5.0, 19.0), "on lines");
        // Three rows behind the last reading before the gap, and before the first behind it.
        let there: Vec<usize> = (20..48).filter(|row| carried[*row].is_finite()).collect();
        assert_eq!(there, [20, 21, 22]);
        assert!(carried[48..51].iter().all(|value| *value == 51.0));
        let each: Vec<f64> = (0..60).map(|row| if row < 30 { 1.0 } else { f64::NAN }).collect();
        assert!(super::carried(&time, &each)[30].is_nan(), "a reading of every row stands for its own");
    }
}
