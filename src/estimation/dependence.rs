//! How much of an error is a function of a channel.

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
