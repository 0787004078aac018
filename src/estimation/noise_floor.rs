//! How much of a residual is white noise, which no model explains.

use std::ops::Range;

use super::quantile::{MEDIAN_OF_NORMAL, median};
use super::third_differences::{THIRD_DIFFERENCE, third_differences};
use super::thresholds::THRESHOLDS;

/// Third differences; zeros and what is not a number are missing.
fn differences(values: &[f64], pieces: &[Range<usize>]) -> Vec<f64> {
    let pieces = pieces.iter().map(|piece| &values[piece.clone()]);
    third_differences(pieces, |value| *value != 0.0 && value.is_finite())
}

/// Standard deviation of what changes from sample to sample: third differences forget what moves slowly, and
/// their median forgets a spike here and there. `pieces` are cut at holes; zeros and what is not a number are missing.
#[must_use]
pub fn white_noise(values: &[f64], pieces: &[Range<usize>]) -> f64 {
    let differences = differences(values, pieces);
    let Some(middle) = median(differences.iter().copied()) else { return 0.0 };
    let middle = middle / (MEDIAN_OF_NORMAL * THIRD_DIFFERENCE.sqrt());
    if middle > 0.0 {
        return middle;
    }
    // More than half of them are nothing at all: a coarse grid. Then every one of them counts.
    rms_noise(&differences)
}

/// Standard deviation from the mean square of third differences.
fn rms_noise(differences: &[f64]) -> f64 {
    let sum: f64 = differences.iter().map(|value| value * value).sum();
    (sum / (THIRD_DIFFERENCE * differences.len().max(1) as f64)).sqrt()
}

/// The same of a reading in steps of `step`. Where the noise does not reach over a step, neighbours read the same and what the
/// steps take away, step/√12 rms, does not change from sample to sample: what changes is too small for it.
#[must_use]
pub fn noise_of_reading(values: &[f64], pieces: &[Range<usize>], step: f64) -> f64 {
    let noise = white_noise(values, pieces);
    if !(step.is_finite() && DITHERED * step > noise) {
        return noise;
    }
    let steps = step / 12.0_f64.sqrt();
    let at_most = (DITHERED * step).hypot(steps);
    let each = rms_noise(&differences(values, pieces));
    noise.max(steps).max(each.min(at_most))
}

/// Steps that noise must reach over, as its standard deviation, to be seen for what it is.
pub const DITHERED: f64 = THRESHOLDS.dithered;
/// [-] share of a signal's own spread below which no error says anything about physics.
pub const RESOLUTION: f64 = THRESHOLDS.resolution;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::moments::deviation;
    use crate::estimation::quantization_step::quantization_step;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    fn noise(count: usize, sigma: f64) -> Vec<f64> {
        let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let normal = Normal::new(0.0, sigma).expect("a normal distribution");
        (0..count).map(|_| normal.sample(&mut generator)).collect()
    }

    /// White noise of size 2 on a slow wave ten times as large, with spikes: the noise is found.
    #[test]
    fn noise_is_seen_through_a_wave_and_spikes() {
        let mut values = noise(6000, 2.0);
        for (row, value) in values.iter_mut().enumerate() {
            *value += 20.0 * (row as f64 * 0.02).sin() + if row % 100 == 0 { 100.0 } else { 0.0 };
        }
        // The median over 6000 third differences scatters by 2 %; spikes in 4 % of them add 5 %.
        let found = white_noise(&values, std::slice::from_ref(&(0..6000)));
        assert!((found - 2.0).abs() < 0.2, "{found}");
    }

    /// Of a sensor that reads in every second or third row only, the noise is the same.
    #[test]
    fn noise_of_a_sensor_slower_than_the_rows_is_seen() {
        for (stride, missing) in [(2, 0.0), (2, f64::NAN), (3, 0.0)] {
            let mut values = noise(6000, 2.0);
            let slow = values.iter_mut().enumerate().filter(|(row, _)| row % stride != 0);
            slow.for_each(|(_, value)| *value = missing);
            let found = white_noise(&values, std::slice::from_ref(&(0..6000)));
            // The median over 2000 third differences scatters by 4 %.
            assert!((found - 2.0).abs() < 0.25, "{stride}: {found}");
            let (level, carried) = crate::estimation::smoother::smooth(&values);
            assert!(level.iter().chain(&carried).all(|value| value.is_finite()), "{stride}");
        }
    }

    /// A signal that moves by a few steps from sample to sample, read in steps larger than its noise: noise and steps together
    /// are what a perfect model leaves.
    #[test]
    fn the_floor_of_a_coarse_reading_has_its_steps_in_it() {
        let whole = std::slice::from_ref(&(0..6000));
        for (step, sigma) in [(5.0, 1.5), (3.0, 0.45), (1.5, 0.45), (10.0, 1.5), (0.1, 1.5)] {
            let truth: Vec<f64> = (0..6000).map(|row| 600.0 + 100.0 * (row as f64 * 0.2).sin()).collect();
            let read: Vec<f64> = noise(6000, sigma)
                .iter()
                .zip(&truth)
                .map(|(noise, truth)| ((truth + noise) / step).round() * step)
                .collect();
            let found = quantization_step(read.iter().copied());
            assert!((found / step - 1.0).abs() < 1e-3, "{step}: {found}");
            let left: Vec<f64> = read.iter().zip(&truth).map(|(read, truth)| read - truth).collect();
            let rms = deviation(left.iter().copied());
            let floor = noise_of_reading(&left, whole, found);
            // 10 % over the floor is what counts as something missing. What steps do to a smooth signal changes sign more often
            // than noise would, which third differences take for more, by 14 % here.
            assert!((0.92..1.2).contains(&(floor / rms)), "{step}, {sigma}: {floor} of {rms}");
        }
        assert_eq!(quantization_step(noise(6000, 1.0).into_iter()), 0.0, "no steps");
    }
}
