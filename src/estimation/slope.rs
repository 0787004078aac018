//! Slopes of signals over time.

use std::ops::Range;

use super::moments::mean;

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
    let around = |row: usize| row.saturating_sub(half)..(row + half + 1).min(values.len());
    let at = |row: usize| slope(&time[around(row)], &values[around(row)]).0;
    (0..values.len()).map(at).collect()
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
