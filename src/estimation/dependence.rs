//! How much of an error is a function of a channel: the mean error in bins of the channel, of equal count.

use super::moments::{mean, mean_square};
use super::thresholds::THRESHOLDS;

/// Mean square of the error's mean by bin of the channel, less what chance alone would give, in the square of the error's unit;
/// a constant error is an error too. Rows where the channel is missing are left out; zero of too few.
#[must_use]
pub fn explained(error: &[f64], channel: &[f64]) -> f64 {
    let count = THRESHOLDS.bins;
    let mut order: Vec<usize> = (0..error.len()).filter(|row| channel[*row].is_finite()).collect();
    order.sort_by(|a, b| channel[*a].total_cmp(&channel[*b]));
    if order.len() < 4 * count {
        return 0.0;
    }
    let size = order.len().div_ceil(count);
    let bins = order.chunks(size).map(|bin| {
        let level = mean(&bin.iter().map(|row| error[*row]).collect::<Vec<f64>>());
        level * level * bin.len() as f64
    });
    let explained = bins.sum::<f64>() / order.len() as f64;
    let chance = (mean_square(error) - explained) * count as f64 / (order.len() - count) as f64;
    (explained - chance).max(0.0)
}

/// The share of an error's variance that is a function of a channel, beside what the channel's surrogates reach.
#[derive(Debug, Clone, PartialEq)]
pub struct BinnedDependence {
    /// [-] share of the error's variance that the mean over the channel's bins carries.
    pub explained: f64,
    /// [-] the largest share that the same channel reached, shifted in time so that it means nothing.
    pub surrogate: f64,
    /// Middle of each bin, in the channel's unit, and mean error there, in the error's unit.
    pub curve: Vec<(f64, f64)>,
}

impl BinnedDependence {
    /// Over `bins` of equal count, beside so many surrogates; `None` when the channel hardly moves or is mostly missing.
    #[must_use]
    pub fn of(channel: &[f64], error: &[f64], bins: usize, surrogates: usize) -> Option<Self> {
        let mut order: Vec<usize> =
            (0..error.len()).filter(|k| channel[*k].is_finite() && error[*k].is_finite()).collect();
        let known = error.iter().filter(|error| error.is_finite()).count();
        if order.len() < 4 * bins || 2 * order.len() < known {
            return None;
        }
        let kept = order.clone();
        order.sort_by(|a, b| channel[*a].total_cmp(&channel[*b]));
        if channel[order[0]] == channel[order[order.len() - 1]] {
            return None;
        }
        let bin_of = bins_of(channel, &order, bins);
        let errors: Vec<f64> = kept.iter().map(|k| error[*k]).collect();
        let own: Vec<usize> = kept.iter().map(|k| bin_of[*k]).collect();
        let (explained, means) = share(&own, &errors, 0, bins);
        let surrogate = (1..=surrogates).map(|number| {
            // Shifts spread over the middle nine tenths of the record: none is near to no shift at all.
            let part = 0.05 + 0.9 * number as f64 / (surrogates + 1) as f64;
            share(&own, &errors, (part * errors.len() as f64) as usize, bins).0
        });
        let surrogate = surrogate.fold(0.0, f64::max);
        let curve = (0..bins).filter_map(|bin| {
            let inside: Vec<f64> = order.iter().filter(|k| bin_of[**k] == bin).map(|k| channel[*k]).collect();
            let middle = *inside.get(inside.len() / 2)?;
            Some((middle, means[bin]))
        });
        Some(Self { explained, surrogate, curve: curve.collect() })
    }
}

/// The bin of each row of a channel; `order` are the rows that hold a value, by size.
fn bins_of(channel: &[f64], order: &[usize], bins: usize) -> Vec<usize> {
    let mut bin_of = vec![0; channel.len()];
    for (rank, k) in order.iter().enumerate() {
        bin_of[*k] = rank * bins / order.len();
    }
    // Samples of one value share a bin, or the order of the file would decide.
    for pair in order.windows(2) {
        if channel[pair[0]] == channel[pair[1]] {
            bin_of[pair[1]] = bin_of[pair[0]];
        }
    }
    bin_of
}

/// Share of the variance of `errors` that the bins' means carry, with the channel `shift` samples aside;
/// corrected for what that many means carry of anything. And the means.
fn share(bin_of: &[usize], errors: &[f64], shift: usize, bins: usize) -> (f64, Vec<f64>) {
    let count = errors.len() as f64;
    let mut sums = vec![(0.0, 0.0); bins];
    for (k, error) in errors.iter().enumerate() {
        let bin = bin_of[(k + shift) % bin_of.len()];
        sums[bin].0 += error;
        sums[bin].1 += 1.0;
    }
    let mean = errors.iter().sum::<f64>() / count;
    let total: f64 = errors.iter().map(|error| (error - mean).powi(2)).sum();
    let of_bin = |(sum, number): &(f64, f64)| if *number > 0.0 { sum / number } else { 0.0 };
    let means: Vec<f64> = sums.iter().map(of_bin).collect();
    let between: f64 = sums.iter().zip(&means).map(|((_, number), m)| number * (m - mean).powi(2)).sum();
    if total <= 0.0 {
        return (0.0, means);
    }
    let used = sums.iter().filter(|(_, number)| *number > 0.0).count() as f64;
    let within = (total - between) / (count - used);
    ((1.0 - within / (total / (count - 1.0))).max(0.0), means)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a law every share, of what is free of one none that its surrogates do not reach.
    #[test]
    fn a_law_is_found_in_its_channel_and_chance_is_called_chance() {
        let channel: Vec<f64> = (0..3_000).map(|k| (0.013 * f64::from(k)).sin()).collect();
        let law: Vec<f64> = channel.iter().map(|value| -0.4 * value * value).collect();
        let found = BinnedDependence::of(&channel, &law, 24, 19).expect("enough of both");
        assert!(found.explained > 0.95 && found.surrogate < 0.5 * found.explained, "{found:?}");
        let noise: Vec<f64> = (0..3_000).map(|k| f64::from(k * 7_919 % 1_000) / 1_000.0 - 0.5).collect();
        let found = BinnedDependence::of(&channel, &noise, 24, 19).expect("enough of both");
        assert!(found.explained < found.surrogate + 0.02, "{found:?}");
        assert_eq!(BinnedDependence::of(&[1.0; 3_000], &noise, 24, 19), None, "a channel that does not move");
    }
}
