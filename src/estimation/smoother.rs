//! The level under noisy values, and an example of the noise that it still carries.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::kalman_smoother::{
    Belief, LinearSystem, Measurement, Transition, likelihood, smooth as smooth_states,
};
use super::moments::squares_about_mean;
use super::noise_floor::SensorNoise;
use super::thresholds::THRESHOLDS;
use crate::cancel;

/// The level under noisy values: a random walk, its step chosen by likelihood. Not-a-number = missing. With it an example of
/// the noise that the level still carries: `noise` of the same size and memory, smoothed in the same way.
#[must_use]
pub fn smooth(values: &[f64], noise: &SensorNoise) -> (Vec<f64>, Vec<f64>) {
    let walk = walk(values);
    if walk == 0.0 {
        // The mean of many values carries next to none.
        return (vec![constant(values); values.len()], vec![0.0; values.len()]);
    }
    let mut noise = example(values.len(), noise);
    copy_missing(&mut noise, values);
    let propagated = level(&noise, walk);
    drop(noise);
    (level(values, walk), propagated)
}

/// Marks as missing in an example of noise what is missing in the values that it belongs to.
pub fn copy_missing(example: &mut [f64], values: &[f64]) {
    let missing = example.iter_mut().zip(values).filter(|(_, value)| !value.is_finite());
    missing.for_each(|(example, _)| *example = f64::NAN);
}

/// An example of a noise, the same each time.
fn example(count: usize, noise: &SensorNoise) -> Vec<f64> {
    cancel::check();
    let mut values = white(count, noise.rms);
    let new = (1.0 - noise.memory * noise.memory).sqrt();
    for row in 1..count {
        values[row] = noise.memory * values[row - 1] + new * values[row];
    }
    values
}

/// White noise of a size, the same each time.
#[must_use]
pub fn white(count: usize, size: f64) -> Vec<f64> {
    let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    (0..count).map(|_| size * Distribution::<f64>::sample(&StandardNormal, &mut generator)).collect()
}

/// A level that is a random walk from sample to sample, read with noise; both over the size of the noise.
struct Level<'a> {
    values: &'a [f64],
    walk: f64,
}

impl LinearSystem<1, 1> for Level<'_> {
    fn samples(&self) -> usize {
        self.values.len()
    }

    /// As uncertain as a sample of noise, so that the first sample does not stand for the level; half of that where it is there.
    fn start(&self) -> Belief<1> {
        let first = self.values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
        let is_read = self.values.first().is_some_and(|value| value.is_finite());
        Belief { state: [first].into(), covariance: [[if is_read { 0.5 } else { 1.0 }]].into() }
    }

    /// The first sample is where the level starts.
    fn readings(&self, sample: usize) -> [Measurement<1>; 1] {
        let value = if sample == 0 { f64::NAN } else { self.values[sample] };
        [Measurement { value, noise: 1.0, of: [[1.0]].into() }]
    }

    fn step(&self, _sample: usize) -> Transition<1> {
        let variance = [self.walk * self.walk].into();
        Transition { transition: [[1.0]].into(), input: [0.0].into(), variance }
    }
}

/// How far the level walks from sample to sample, over the noise.
fn walk(values: &[f64]) -> f64 {
    let likelihood = |walk: f64| {
        let penalty = if walk > 0.0 { THRESHOLDS.walk_penalty } else { 0.0 };
        likelihood(&Level { values, walk }, values.len()).at_best_scale() - penalty
    };
    let best = THRESHOLDS.walks.iter().copied().map(|walk| (likelihood(walk), walk));
    best.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, walk)| walk)
}

fn level(values: &[f64], walk: f64) -> Vec<f64> {
    let mut level = vec![f64::NAN; values.len()];
    smooth_states(&Level { values, walk }, 0, |sample, state, _| level[sample] = state);
    level
}

/// The mean where it is plainly not zero: a mean within its own scatter is noise, and noise would drive what
/// follows.
fn constant(values: &[f64]) -> f64 {
    let count = values.iter().filter(|value| value.is_finite()).count().max(1) as f64;
    let (mean, squares) = squares_about_mean(values.iter().copied().filter(|value| value.is_finite()));
    let scatter = squares.sqrt() / count;
    if mean.abs() > THRESHOLDS.mean_errors * scatter { mean } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_under_noise_is_smoothed_to_a_constant() {
        let (level, _) = smooth(&white(2000, 1.0), &SensorNoise::white(1.0));
        // The mean of 2000 values of noise 1 lies within four times 0.022.
        assert!(level.iter().all(|level| level.abs() < 0.1));
    }

    #[test]
    fn a_wave_under_noise_stays() {
        let mut values = white(2000, 0.1);
        values.iter_mut().enumerate().for_each(|(row, value)| *value += (row as f64 * 0.02).sin());
        let (level, _) = smooth(&values, &SensorNoise::white(0.1));
        let wrong = level
            .iter()
            .enumerate()
            .map(|(row, level)| (level - (row as f64 * 0.02).sin()).powi(2))
            .sum::<f64>();
        // Less than half of the noise remains.
        assert!((wrong / 2000.0).sqrt() < 0.05);
    }
}
