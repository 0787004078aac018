//! Slopes of signals over time.

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

/// [unit/s] slope at each sample, by straight lines through `half` samples to both sides.
#[must_use]
pub fn centred_slopes(time: &[f64], values: &[f64], half: usize) -> Vec<f64> {
    let around = |row: usize| row.saturating_sub(half)..(row + half + 1).min(values.len());
    let at = |row: usize| slope(&time[around(row)], &values[around(row)]).0;
    (0..values.len()).map(at).collect()
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
}
