//! Slopes of signals over time.

use std::ops::Range;

use wide::f64x4;

use super::moments::{mean, squares_about_mean};
use crate::cancel;
use crate::threads::spread;

/// The slope of the straight line through `values` over `time` by least squares [unit/s], and the sum of squares of time about
/// its mean [s²]: one over it is the slope's variance under white noise of size one.
#[must_use]
pub fn slope(time: &[f64], values: &[f64]) -> (f64, f64) {
    let (middle, level) = (mean(time), mean(values));
    let (mut up, mut spread) = (0.0, f64::MIN_POSITIVE);
    for (at, value) in time.iter().zip(values) {
        up += (at - middle) * (value - level);
        spread += (at - middle) * (at - middle);
    }
    (up / spread, spread)
}

/// Sum of squares of what a straight line leaves of evenly spaced values.
#[must_use]
pub fn beside_a_line(values: &[f64]) -> f64 {
    let index: Vec<f64> = (0..values.len()).map(|index| index as f64).collect();
    let (slope, spread) = slope(&index, values);
    let (_, power) = squares_about_mean(values.iter().copied());
    (power - slope * slope * spread).max(0.0)
}

/// [unit/s] slope of each of these signals at each sample, by straight lines through `half` samples to both sides. They share their
/// clock, are as long as it, and share what is reckoned of it.
#[must_use]
pub fn centred_slopes<const N: usize>(time: &[f64], signals: [&[f64]; N], half: usize) -> [Vec<f64>; N] {
    /// Samples of a piece of work: some milliseconds.
    const PIECE: usize = 1 << 16;
    let pieces: Vec<Range<usize>> =
        (0..time.len()).step_by(PIECE).map(|from| from..(from + PIECE).min(time.len())).collect();
    let found = spread(&pieces, |piece| slopes_in(time, signals, piece, half));
    std::array::from_fn(|signal| found.iter().flat_map(|slopes| &slopes[signal]).copied().collect())
}

/// The same of a piece of the samples.
fn slopes_in<const N: usize>(
    time: &[f64],
    signals: [&[f64]; N],
    piece: &Range<usize>,
    half: usize,
) -> [Vec<f64>; N] {
    let mut slopes: [Vec<f64>; N] = std::array::from_fn(|_| Vec::with_capacity(piece.len() + 3));
    let mut row = piece.start;
    while row < piece.end {
        let window = row.saturating_sub(half)..row + half + 1;
        let four = side_by_side(time, signals, window, half);
        row += if four.is_some() { 4 } else { 1 };
        for (signal, slopes) in slopes.iter_mut().enumerate() {
            match &four {
                Some(four) => slopes.extend(four[signal]),
                None => slopes.push(centred_slope(time, signals[signal], piece.start + slopes.len(), half)),
            }
        }
    }
    slopes.iter_mut().for_each(|slopes| slopes.truncate(piece.len()));
    slopes
}

/// [unit/s] the same at one sample.
#[must_use]
pub fn centred_slope(time: &[f64], values: &[f64], row: usize, half: usize) -> f64 {
    let around = row.saturating_sub(half)..(row + half + 1).min(values.len());
    slope(&time[around.clone()], &values[around]).0
}

/// [unit/s] the same over the readings that are there; zero of fewer than two.
#[must_use]
pub fn finite_slope(time: &[f64], values: &[f64], row: usize, half: usize) -> f64 {
    let around = row.saturating_sub(half)..(row + half + 1).min(values.len());
    let is_there = |at: &usize| values[*at].is_finite();
    let (times, there): (Vec<f64>, Vec<f64>) =
        around.filter(is_there).map(|at| (time[at], values[at])).unzip();
    if there.len() < 2 { 0.0 } else { slope(&times, &there).0 }
}

/// [unit/s] noise of a slope through `half` samples to both sides, `interval` [s] apart, of readings with a noise of one unit.
#[must_use]
pub fn centred_slope_noise(half: usize, interval: f64) -> f64 {
    let n = half as f64;
    1.0 / (interval * (n * (n + 1.0) * (2.0 * n + 1.0) / 3.0).sqrt())
}

/// The slopes in a window of rows and in the three behind it, each summed up as [`slope`] does, to the last digit: one would wait
/// for its own sums at every step. `None` where not all four are whole.
fn side_by_side<const N: usize>(
    time: &[f64],
    signals: [&[f64]; N],
    window: Range<usize>,
    half: usize,
) -> Option<[[f64; 4]; N]> {
    let rows = 2 * half + 1;
    if window.len() < rows {
        return None;
    }
    // Cut to what the loops below ask for, so that no step of theirs asks whether it is there.
    let all = rows.checked_add(3)?;
    let time = time.get(window.start..)?.get(..all)?;
    let mut values: [&[f64]; N] = [&[]; N];
    for (values, signal) in values.iter_mut().zip(signals) {
        *values = signal.get(window.start..)?.get(..all)?;
    }
    let four = |of: &[f64], row: usize| f64x4::from([of[row], of[row + 1], of[row + 2], of[row + 3]]);
    let (mut middle, mut levels) = (f64x4::splat(-0.0), [f64x4::splat(-0.0); N]);
    for row in 0..rows {
        middle += four(time, row);
        for signal in 0..N {
            levels[signal] += four(values[signal], row);
        }
    }
    let count = f64x4::splat(rows as f64);
    let (middle, levels) = (middle / count, levels.map(|level| level / count));
    let (mut ups, mut spread) = ([f64x4::splat(0.0); N], f64x4::splat(f64::MIN_POSITIVE));
    for row in 0..rows {
        let time = four(time, row) - middle;
        for signal in 0..N {
            ups[signal] += time * (four(values[signal], row) - levels[signal]);
        }
        spread += time * time;
    }
    Some(ups.map(|up| (up / spread).to_array()))
}

/// The same within each of these `pieces`; not-a-number beside them.
#[must_use]
pub fn centred_slopes_within(time: &[f64], values: &[f64], pieces: &[Range<usize>], half: usize) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; values.len()];
    for piece in pieces {
        let [found] = centred_slopes(&time[piece.clone()], [&values[piece.clone()]], half);
        slopes[piece.clone()].copy_from_slice(&found);
    }
    slopes
}

/// [unit/s] how a signal rises within the interval after each sample; zero behind the last.
#[must_use]
pub fn forward_slopes(time: &[f64], values: &[f64]) -> Vec<f64> {
    cancel::check();
    let pairs = time.windows(2).zip(values.windows(2));
    pairs.map(|(time, value)| (value[1] - value[0]) / (time[1] - time[0])).chain([0.0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_has_one_slope() {
        let (time, line) = ([0.0, 0.5, 1.0, 2.0], [1.0, 2.0, 3.0, 5.0]);
        assert_eq!(slope(&time, &line).0, 2.0);
        assert_eq!(centred_slopes(&time, [&line], 2), [[2.0; 4]]);
        assert_eq!(forward_slopes(&time, &line), [2.0, 2.0, 2.0, 0.0]);
    }

    /// To the last digit, at the ends, with a value missing, and where fewer samples are there than a window holds.
    #[test]
    fn slopes_side_by_side_are_those_of_one_after_the_other() {
        // The last one goes on in a second piece.
        for (samples, half) in [(40, 2), (43, 7), (9, 4), (3, 5), (0, 2), ((1 << 16) + 9, 2)] {
            let time: Vec<f64> =
                (0..samples).map(|k| 0.01 * f64::from(k) + 1e-4 * f64::from(k % 3)).collect();
            let value = |k: i32| if k == 31 { f64::NAN } else { (0.3 * f64::from(k)).sin() };
            let values: Vec<f64> = (0..samples).map(value).collect();
            let others: Vec<f64> = values.iter().rev().map(|value| 2.0 * value + 1.0).collect();
            let is_same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            let both = centred_slopes(&time, [&values, &others], half);
            for (values, found) in [&values, &others].into_iter().zip(both) {
                let alone: Vec<f64> =
                    (0..values.len()).map(|row| centred_slope(&time, values, row, half)).collect();
                assert!(
                    found.len() == alone.len() && found.iter().zip(&alone).all(is_same),
                    "{samples}, {half}"
                );
            }
        }
    }

    #[test]
    fn slopes_stay_within_their_pieces() {
        let (time, values) = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 2.0, 9.0, 8.0]);
        let slopes = centred_slopes_within(&time, &values, &[0..2, 3..5], 1);
        assert_eq!(slopes[..2], [1.0, 1.0]);
        assert!(slopes[2].is_nan());
        assert_eq!(slopes[3..], [-1.0, -1.0]);
    }

    #[test]
    fn a_line_leaves_nothing_and_what_alternates_about_it_is_left() {
        assert_eq!(beside_a_line(&[1.0, 3.0, 5.0, 7.0]), 0.0);
        // +1, -1, -1, +1 has neither level nor slope.
        assert!((beside_a_line(&[2.0, 2.0, 4.0, 8.0]) - 4.0).abs() < 1e-12);
    }
}
