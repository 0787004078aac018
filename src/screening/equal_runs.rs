//! Runs of equal values in a channel, and how fine its reading is.

use std::ops::Range;

use super::thresholds::THRESHOLDS;

/// The least that a reading ever moves by; infinite where it never moves.
pub(crate) fn smallest_step(readings: &[f64]) -> f64 {
    let steps = readings.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    steps.fold(f64::INFINITY, f64::min)
}

/// Runs of equal values, by place, that are too long for a channel that repeats itself as often as this one does.
pub(crate) fn too_long(values: &[f64]) -> Vec<Range<usize>> {
    let pairs = values.len().saturating_sub(1);
    let equal = values.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if pairs == 0 || equal == 0 {
        return Vec::new();
    }
    // A run of n equal values has about the chance share^(n - 1) at each place.
    let share = equal as f64 / pairs as f64;
    let run = (THRESHOLDS.frozen_chance / pairs as f64).ln() / share.ln();
    let least = (run.ceil() as usize).saturating_add(1).max(THRESHOLDS.frozen_least);
    let mut at = 0;
    let runs = values.chunk_by(|a, b| a == b).map(|run| {
        at += run.len();
        at - run.len()..at
    });
    runs.filter(|run| run.len() >= least).collect()
}
