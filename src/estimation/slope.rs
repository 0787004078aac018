//! Slopes of signals over time.

use std::ops::Range;

use wide::f64x4;

use super::moments::mean;
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
    let ((slope, spread), mean) = (slope(&index, values), mean(values));
    let power: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (power - slope * slope * spread).max(0.0)
}

/// [unit/s] slope at each sample, by straight lines through `half` samples to both sides.
#[must_use]
pub fn centred_slopes(time: &[f64], values: &[f64], half: usize) -> Vec<f64> {
    /// Samples of a piece of work: some milliseconds.
    const PIECE: usize = 1 << 16;
    let pieces: Vec<Range<usize>> =
        (0..values.len()).step_by(PIECE).map(|from| from..(from + PIECE).min(values.len())).collect();
    spread(&pieces, |piece| slopes_in(time, values, piece, half)).concat()
}

/// The same of a piece of the samples.
fn slopes_in(time: &[f64], values: &[f64], piece: &Range<usize>, half: usize) -> Vec<f64> {
    let mut slopes = Vec::with_capacity(piece.len() + 3);
    while slopes.len() < piece.len() {
        let row = piece.start + slopes.len();
        let window = row.saturating_sub(half)..row + half + 1;
        match side_by_side(time, values, window, half) {
            Some(four) => slopes.extend(four),
            None => slopes.push(centred_slope(time, values, row, half)),
        }
    }
    slopes.truncate(piece.len());
    slopes
}

/// [unit/s] the same at one sample.
#[must_use]
pub fn centred_slope(time: &[f64], values: &[f64], row: usize, half: usize) -> f64 {
    let around = row.saturating_sub(half)..(row + half + 1).min(values.len());
    slope(&time[around.clone()], &values[around]).0
}

/// The slopes in a window of rows and in the three behind it, each summed up as [`slope`] does, to the last digit: one would wait
/// for its own sums at every step. `None` where not all four are whole.
fn side_by_side(time: &[f64], values: &[f64], window: Range<usize>, half: usize) -> Option<[f64; 4]> {
    let rows = 2 * half + 1;
    let reach = window.start..window.end + 3;
    let (time, values) = (time.get(reach.clone())?, values.get(reach)?);
    if window.len() < rows {
        return None;
    }
    let four = |four: &[f64]| f64x4::from([four[0], four[1], four[2], four[3]]);
    // As many as there are rows.
    let fours = || time.windows(4).zip(values.windows(4));
    let (mut middle, mut level) = (f64x4::splat(-0.0), f64x4::splat(-0.0));
    for (time, values) in fours() {
        middle += four(time);
        level += four(values);
    }
    let count = f64x4::splat(rows as f64);
    let (middle, level) = (middle / count, level / count);
    let (mut up, mut spread) = (f64x4::splat(0.0), f64x4::splat(f64::MIN_POSITIVE));
    for (time, values) in fours() {
        let (time, value) = (four(time) - middle, four(values) - level);
        up += time * value;
        spread += time * time;
    }
    Some((up / spread).to_array())
}

/// The same within each of these `pieces`; not-a-number beside them.
#[must_use]
pub fn centred_slopes_within(time: &[f64], values: &[f64], pieces: &[Range<usize>], half: usize) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; values.len()];
    for piece in pieces {
        let found = centred_slopes(&time[piece.clone()], &values[piece.clone()], half);
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
        assert_eq!(centred_slopes(&time, &line, 2), [2.0; 4]);
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
            let found = centred_slopes(&time, &values, half);
            let alone: Vec<f64> =
                (0..values.len()).map(|row| centred_slope(&time, &values, row, half)).collect();
            let is_same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            assert!(found.len() == alone.len() && found.iter().zip(&alone).all(is_same), "{samples}, {half}");
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
