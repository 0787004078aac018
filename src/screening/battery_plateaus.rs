//! A battery that is read in few steps stands on each of them, its plateaus.

use super::rotor_data::bounds;
use super::thresholds::THRESHOLDS;

/// [V] the step of a reading that has few; `None` of a fine one, or of one that never moves.
pub(crate) fn step_of(voltage: &[f64]) -> Option<f64> {
    let changes = || voltage.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let step = changes().filter(|change| *change > THRESHOLDS.finest_step).reduce(f64::min)?;
    let (low, high) = bounds(voltage);
    let off = |change: f64| (change / step - (change / step).round()).abs() > THRESHOLDS.step_tolerance;
    (high - low <= THRESHOLDS.quantized_steps * step && !changes().any(off)).then_some(step)
}

/// [s] what a plateau may last, by how long those last over which a quantized reading goes; zero where it is none.
pub(crate) fn longest_plateau(time: &[f64], voltage: &[f64]) -> f64 {
    let (low, high) = bounds(voltage);
    let plateaus = step_of(voltage).map(|step| (high - low) / step + 1.0);
    plateaus.map_or(0.0, |plateaus| THRESHOLDS.longest_plateau * (time[time.len() - 1] - time[0]) / plateaus)
}
