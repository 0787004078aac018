//! The variance of a number by the values that it has on other data (Efron, Stein 1981).

use super::moments::mean;

/// The variance of one of two values of a number, from data that have nothing in common: half of their squared difference.
#[must_use]
pub(crate) fn of_two(one: f64, other: f64) -> f64 {
    (other - one).powi(2) / 2.0
}

/// The variance of a number whose values are from data that lack one part each, in turn; 0 of fewer than two.
#[must_use]
pub(crate) fn of_left_out(values: &[f64]) -> f64 {
    let (count, centre) = (values.len() as f64, mean(values));
    let spread: f64 = values.iter().map(|value| (value - centre).powi(2)).sum();
    if values.len() < 2 { 0.0 } else { spread * (count - 1.0) / count }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_a_mean_is_what_the_jackknife_says_and_of_two_fits_half_their_square() {
        // The mean of six numbers from fits that lack two each: variance of the mean of three pairs.
        let pairs = [1.0, 2.0, 6.0];
        let total: f64 = pairs.iter().sum();
        let lacking = pairs.map(|own| (total - own) / 2.0);
        let centre = total / 3.0;
        let of_mean = pairs.iter().map(|own| (own - centre).powi(2)).sum::<f64>() / 2.0 / 3.0;
        assert!((of_left_out(&lacking) - of_mean).abs() < 1e-12);
        assert_eq!(of_two(3.0, 5.0), 2.0);
        assert_eq!((of_left_out(&[5.0]), of_left_out(&[])), (0.0, 0.0), "one part says nothing");
    }
}
