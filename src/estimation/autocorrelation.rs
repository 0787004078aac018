//! How a residual resembles itself some samples later.

use super::thresholds::THRESHOLDS;

/// Lag-one correlation of a residual; 0 when it has no variance.
pub(crate) fn lag_one_correlation(residuals: &[f64]) -> f64 {
    correlation(residuals, 1)
}

fn correlation(residuals: &[f64], lag: usize) -> f64 {
    let products: f64 = residuals.iter().zip(residuals.iter().skip(lag)).map(|(a, b)| a * b).sum();
    let squares: f64 = residuals.iter().map(|value| value * value).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// By how much the variance of a mean, or of a fitted number, grows under noise whose correlation falls by this factor from
/// sample to sample.
pub(crate) fn variance_inflation(correlation: f64) -> f64 {
    (1.0 + correlation) / (1.0 - correlation)
}

/// Factor by which the correlation of a residual falls from row to row. Slow noise under white noise starts low and
/// falls slowly: that shows in the second lag against the first.
pub(crate) fn memory(residuals: &[f64]) -> f64 {
    let (first, second) = (correlation(residuals, 1), correlation(residuals, 2));
    if first < THRESHOLDS.memory_errors / (residuals.len() as f64).sqrt() {
        first
    } else {
        first.max(second / first).min(1.0)
    }
}
