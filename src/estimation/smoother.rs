//! The level under noisy values, and an example of the noise that it still carries.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::noise_floor::white_noise;
use super::thresholds::THRESHOLDS;

/// The level under noisy values: a random walk, its wandering chosen by likelihood, smoothed forwards and
/// backwards (Kalman, Rauch-Tung-Striebel). Not-a-number = missing. With it an example of the noise that the level
/// still carries: white noise of the same size, smoothed in the same way.
#[must_use]
pub fn smooth(values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let wandering = wandering(values);
    if wandering == 0.0 {
        // The mean of many values carries next to none.
        return (vec![constant(values); values.len()], vec![0.0; values.len()]);
    }
    let mut noise = white(values.len(), white_noise(values, std::slice::from_ref(&(0..values.len()))));
    copy_missing(&mut noise, values);
    (smoothed(values, wandering), smoothed(&noise, wandering))
}

/// Marks as missing in an example of noise what is missing in the values that it belongs to.
pub fn copy_missing(example: &mut [f64], values: &[f64]) {
    let missing = example.iter_mut().zip(values).filter(|(_, value)| !value.is_finite());
    missing.for_each(|(example, _)| *example = f64::NAN);
}

/// White noise of a size, the same each time.
#[must_use]
pub fn white(count: usize, size: f64) -> Vec<f64> {
    let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    (0..count).map(|_| size * Distribution::<f64>::sample(&StandardNormal, &mut generator)).collect()
}

/// How much the level wanders from sample to sample, over the noise.
fn wandering(values: &[f64]) -> f64 {
    let likelihood = |wandering: &f64| {
        let penalty = if *wandering > 0.0 { THRESHOLDS.wandering_penalty } else { 0.0 };
        filter(values, *wandering).0 - penalty
    };
    let best = THRESHOLDS.wanderings.iter().copied().map(|wandering| (likelihood(&wandering), wandering));
    best.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, wandering)| wandering)
}

fn smoothed(values: &[f64], wandering: f64) -> Vec<f64> {
    let (_, levels, variances) = filter(values, wandering);
    let mut smooth = levels.clone();
    for row in (0..values.len().saturating_sub(1)).rev() {
        let gain = variances[row] / (variances[row] + wandering * wandering);
        smooth[row] = levels[row] + gain * (smooth[row + 1] - levels[row]);
    }
    smooth
}

/// The mean where it is plainly not zero: a mean within its own scatter is noise, and noise would drive what
/// follows.
fn constant(values: &[f64]) -> f64 {
    let count = values.iter().filter(|value| value.is_finite()).count().max(1) as f64;
    let finite = || values.iter().filter(|value| value.is_finite());
    let mean = finite().sum::<f64>() / count;
    let scatter = finite().map(|value| (value - mean).powi(2)).sum::<f64>().sqrt() / count;
    if mean.abs() > THRESHOLDS.mean_errors * scatter { mean } else { 0.0 }
}

/// The log-likelihood with the noise's size concentrated out, and level and variance (over noise) at each sample.
fn filter(values: &[f64], wandering: f64) -> (f64, Vec<f64>, Vec<f64>) {
    let first = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    // A start as uncertain as a few samples of noise, so that the first sample does not stand for the level.
    let (mut level, mut variance) = (first, 1.0);
    let (mut squares, mut logs, mut count) = (0.0, 0.0, 0.0_f64);
    let mut levels = Vec::with_capacity(values.len());
    let mut variances = Vec::with_capacity(values.len());
    for (row, value) in values.iter().enumerate() {
        if row > 0 {
            variance += wandering * wandering;
        }
        if value.is_finite() {
            let total = variance + 1.0;
            let surprise = value - level;
            if row > 0 {
                squares += surprise * surprise / total;
                logs += total.ln();
                count += 1.0;
            }
            let gain = variance / total;
            level += gain * surprise;
            variance *= 1.0 - gain;
        }
        levels.push(level);
        variances.push(variance);
    }
    let count = count.max(1.0);
    (-0.5 * (count * (squares / count).max(f64::MIN_POSITIVE).ln() + logs), levels, variances)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_under_noise_is_smoothed_to_a_constant() {
        let (level, _) = smooth(&white(2000, 1.0));
        // The mean of 2000 values of noise 1 lies within four times 0.022.
        assert!(level.iter().all(|level| level.abs() < 0.1));
    }

    #[test]
    fn a_wave_under_noise_stays() {
        let mut values = white(2000, 0.1);
        values.iter_mut().enumerate().for_each(|(row, value)| *value += (row as f64 * 0.02).sin());
        let (level, _) = smooth(&values);
        let wrong = level
            .iter()
            .enumerate()
            .map(|(row, level)| (level - (row as f64 * 0.02).sin()).powi(2))
            .sum::<f64>();
        // Less than half of the noise remains.
        assert!((wrong / 2000.0).sqrt() < 0.05);
    }
}
