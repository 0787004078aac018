//! How steadily one fit is better than another, from stretch to stretch.

use super::measured_rows::Residuals;
use super::moments::mean_and_error;

/// By how much the squared residuals fall from `before` to `after`, over the standard error of that fall from one of
/// `stretches` to the next; stretches without a measurement (all zero) are left out, and of fewer than `fewest` it is zero.
#[must_use]
pub fn consistency(before: &Residuals, after: &Residuals, stretches: usize, fewest: usize) -> f64 {
    let rows = before.len().min(after.len());
    let size = before.len().div_ceil(stretches).max(1);
    let falls: Vec<f64> = (0..rows)
        .step_by(size)
        .map(|from| from..(from + size).min(rows))
        .map(|stretch| (before.part(&stretch), after.part(&stretch)))
        .filter(|(before, _)| before.iter().any(|value| *value != 0.0))
        .map(|(before, after)| power(before) - power(after))
        .collect();
    if falls.len() < fewest {
        return 0.0;
    }
    let (fall, error) = mean_and_error(&falls);
    fall / error.max(f64::MIN_POSITIVE)
}

/// The sum of squares, infinite where it is.
#[must_use]
pub fn power(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_in_one_stretch_is_not_steady_and_a_small_one_everywhere_is() {
        let before = vec![1.0; 240];
        let mut once = before.clone();
        once[..10].fill(0.0);
        let steadiness = |before: &[f64], after: &[f64]| {
            consistency(&before.to_vec().into(), &after.to_vec().into(), 24, 4)
        };
        assert!(steadiness(&before, &once) < 1.1);
        let everywhere: Vec<f64> = (0..240).map(|row| 0.99 + 0.001 * f64::from(row / 10 % 2)).collect();
        assert!(steadiness(&before, &everywhere) > 10.0);
        assert!(steadiness(&everywhere, &before) < -10.0);
    }
}
