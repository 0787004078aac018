//! A sum that single large residuals do not rule.

/// Twice the pseudo-Huber loss (Charbonnier 1997): squares of what is small beside `width`, sizes of what is large; the largest
/// number where it has no end: what ran away loses, as with squares.
pub(crate) fn pseudo_huber(residuals: &[f64], width: f64) -> f64 {
    let per_width = 1.0 / width;
    let of = |value: &f64| (1.0 + (value * per_width).powi(2)).sqrt() - 1.0;
    // Sums side by side: each addition of a single one would wait for the one before.
    let mut sums = [0.0; 4];
    let (whole, rest) = residuals.as_chunks::<4>();
    for values in whole {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += of(value));
    }
    let sum = sums.iter().sum::<f64>() + rest.iter().map(of).sum::<f64>();
    if sum.is_finite() { 2.0 * width * width * sum } else { f64::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_residuals_count_by_their_square_and_large_ones_by_their_size() {
        // Off by a quarter of the square of residual over width, and by width over residual.
        assert!((pseudo_huber(&[0.01, -0.02], 2.0) / 5e-4 - 1.0).abs() < 1e-4);
        assert!((pseudo_huber(&[-2e6], 2.0) / 8e6 - 1.0).abs() < 1e-5);
        assert_eq!(pseudo_huber(&[1.0, f64::NAN], 2.0), f64::MAX);
    }
}
