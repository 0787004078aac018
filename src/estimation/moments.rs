//! Mean, mean square and standard deviation.

use std::borrow::Borrow;

/// The mean; not-a-number of none.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of values that come one by one; not-a-number of none.
#[must_use]
pub fn mean_of(values: impl Iterator<Item = f64>) -> f64 {
    let mut count = 0_usize;
    let sum: f64 = values.inspect(|_| count += 1).sum();
    sum / count as f64
}

/// The mean, zero of none, and the sum of the squares about it.
#[must_use]
pub fn squares_about_mean(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let (sum, count) = values.clone().fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    let mean = sum / count.max(1) as f64;
    (mean, values.map(|value| (value - mean).powi(2)).sum())
}

/// The mean and its standard error, of values that know nothing of each other.
#[must_use]
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let (mean, squares) = squares_about_mean(values.iter().copied());
    let variance = squares / (count - 1.0).max(1.0);
    (mean, (variance / count).sqrt())
}

/// The root of the mean square of the values that are there; not-a-number of none.
#[must_use]
pub fn rms_of_finite(values: impl IntoIterator<Item = f64>) -> f64 {
    let finite = values.into_iter().filter(|value| value.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    f64::sqrt(sum / count)
}

/// The rms over all samples, of parts with an rms and a number of samples each; zero of none.
#[must_use]
pub fn pooled_rms(parts: impl Iterator<Item = (f64, usize)>) -> f64 {
    let (mut squares, mut samples) = (0.0, 0);
    for (rms, of) in parts {
        squares += rms * rms * of as f64;
        samples += of;
    }
    (squares / samples.max(1) as f64).sqrt()
}

/// The mean square; zero of none.
#[must_use]
pub fn mean_square(values: impl IntoIterator<Item: Borrow<f64>>) -> f64 {
    let squares = values.into_iter().map(|value| value.borrow() * value.borrow());
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
    sum / f64::max(count, 1.0)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_textbook() {
        let values = [1.0, 2.0, 6.0];
        assert_eq!((mean(&values), mean_of(values.into_iter())), (3.0, 3.0));
        // Squares about the mean: 4 + 1 + 9 over 2, and that over 3.
        assert_eq!(mean_and_error(&values), (3.0, f64::sqrt(7.0 / 3.0)));
        assert_eq!(rms_of_finite([3.0, f64::NAN, 4.0]), f64::sqrt(12.5));
        assert_eq!(mean_square([3.0, 4.0]), 12.5);
        assert_eq!(deviation([1.0, 3.0].into_iter()), 1.0);
    }

    #[test]
    fn of_nothing_there_is_no_mean() {
        assert!(mean(&[]).is_nan() && mean_of(std::iter::empty()).is_nan() && rms_of_finite([]).is_nan());
        assert_eq!((mean_square([0.0; 0]), pooled_rms(std::iter::empty())), (0.0, 0.0));
    }

    #[test]
    fn parts_count_by_their_samples() {
        let all: [f64; 4] = [1.0, 2.0, 3.0, 4.0];
        let rms = |values: &[f64]| mean_square(values).sqrt();
        let parts = [(rms(&all[..1]), 1), (rms(&all[1..]), 3)];
        assert!((pooled_rms(parts.into_iter()) - rms(&all)).abs() < 1e-12);
    }
}
