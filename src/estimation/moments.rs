//! Mean, mean square and standard deviation.

/// The mean; not-a-number of none.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean square; zero of none.
#[must_use]
pub fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64
}

/// Standard deviation of the values that are there; 0 of none.
#[must_use]
pub fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    // Welford: exact for values that are all the same, however large.
    let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for value in values.filter(|value| value.is_finite()) {
        count += 1.0;
        let from_mean = value - mean;
        mean += from_mean / count;
        squares += from_mean * (value - mean);
    }
    f64::sqrt(squares / f64::max(count, 1.0))
}
