//! A normal variable of which only an interval is known: what a reading in coarse steps says.

use std::f64::consts::{PI, SQRT_2};

use super::ridge::RIDGE;

/// What an interval says of a normal variable, in standard deviations of it.
pub(crate) struct CensoredNormal {
    /// Its mean within the interval.
    pub mean: f64,
    /// How much of what the value itself would say of where the distribution lies: all, where the interval is small beside the
    /// scatter, and nothing, where it holds almost all of it.
    pub weight: f64,
    /// How likely the interval is.
    pub share: f64,
}

impl CensoredNormal {
    /// An interval of the length `step` whose middle is `off` above the mean, of a variable with the standard deviation `noise`.
    pub fn of(off: f64, step: f64, noise: f64) -> Self {
        let ends @ [low, high] = [off - 0.5 * step, off + 0.5 * step].map(|end| end / noise);
        let [below, above] = ends.map(|end| 0.5 * libm::erf(end / SQRT_2));
        let share = above - below;
        // So far away that the distribution says nothing: the nearer end.
        if share < RIDGE {
            return Self { mean: 0f64.clamp(low, high), weight: 1.0, share: RIDGE };
        }
        let [at_low, at_high] = ends.map(|end| (-0.5 * end * end).exp() / (2.0 * PI).sqrt());
        let mean = (at_low - at_high) / share;
        Self { mean, weight: mean * mean + (high * at_high - low * at_low) / share, share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean, variance and share within an interval, summed up in ten thousand pieces.
    fn summed(off: f64, step: f64, noise: f64) -> (f64, f64, f64) {
        let piece = step / noise / 1e4;
        let low = (off - 0.5 * step) / noise;
        let at = |index: i32| low + (f64::from(index) + 0.5) * piece;
        let density = |x: f64| (-0.5 * x * x).exp() / (2.0 * PI).sqrt() * piece;
        let sum = |of: &dyn Fn(f64) -> f64| (0..10_000).map(|index| of(at(index)) * density(at(index))).sum();
        let share: f64 = sum(&|_| 1.0);
        let mean: f64 = sum(&|x| x) / share;
        (mean, sum(&|x| (x - mean).powi(2)) / share, share)
    }

    #[test]
    fn mean_and_scatter_within_an_interval_are_those_of_the_density() {
        for (off, step, noise) in [(0.0, 1.0, 1.0), (0.7, 1.0, 0.4), (-2.0, 3.0, 1.0), (0.1, 0.01, 2.0)] {
            let found = CensoredNormal::of(off, step, noise);
            let (mean, variance, share) = summed(off, step, noise);
            // The sum's pieces are off by the square of a ten-thousandth.
            assert!((found.mean - mean).abs() < 1e-6 && (found.share - share).abs() < 1e-7, "{off}");
            assert!((1.0 - found.weight - variance).abs() < 1e-5, "{off}: {} {variance}", found.weight);
        }
        let far = CensoredNormal::of(100.0, 1.0, 1.0);
        assert_eq!((far.mean, far.weight), (99.5, 1.0));
    }
}
