//! Where a rotor is in its free run.

use super::rotor_trace::MOST_STATES;
use super::thresholds::THRESHOLDS;

/// Everything that moves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct RotorState {
    pub(super) rate: f64,
    pub(super) steady: [f64; MOST_STATES],
    pub(super) sensor: [f64; MOST_STATES],
}

impl RotorState {
    /// Whether nothing has moved since, but for rounding.
    pub(super) fn rests_at(&self, before: &Self) -> bool {
        let stays = |now: f64, before: f64| (now - before).abs() <= THRESHOLDS.rests_within * now.abs();
        let all =
            |now: &[f64], before: &[f64]| now.iter().zip(before).all(|(now, before)| stays(*now, *before));
        stays(self.rate, before.rate)
            && all(&self.steady, &before.steady)
            && all(&self.sensor, &before.sensor)
    }
}
