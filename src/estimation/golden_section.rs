//! Golden-section search (Kiefer 1953).

use super::thresholds::THRESHOLDS;

/// The smaller part of the golden ratio, 1/φ.
const SHARE: f64 = 0.618_033_988_749_895;

/// Where a function with one valley is least between two ends, and its value there, to a 5e-4 part of the span.
pub(crate) fn golden(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> (f64, f64) {
    let (mut left, mut right) = (high - SHARE * (high - low), low + SHARE * (high - low));
    let (mut f_left, mut f_right) = (f(left), f(right));
    for _ in 0..THRESHOLDS.golden_steps {
        if f_left <= f_right {
            (high, right, f_right) = (right, left, f_left);
            left = high - SHARE * (high - low);
            f_left = f(left);
        } else {
            (low, left, f_left) = (left, right, f_right);
            right = low + SHARE * (high - low);
            f_right = f(right);
        }
    }
    if f_left <= f_right { (left, f_left) } else { (right, f_right) }
}

/// The candidate at which a function is least: where to search around.
pub(crate) fn least(candidates: impl Iterator<Item = f64>, f: impl Fn(f64) -> f64) -> Option<f64> {
    let costs = candidates.map(|candidate| (candidate, f(candidate)));
    costs.min_by(|a, b| a.1.total_cmp(&b.1)).map(|best| best.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_section_finds_a_valley_also_at_an_end() {
        assert!((golden(|x| (x - 0.3).powi(2), 0.0, 1.0).0 - 0.3).abs() < 1e-3);
        assert!(golden(|x| x, 0.0, 1.0).0 < 1e-3);
    }
}
