//! How a controller answered a torque impulse.

use serde::Serialize;

use super::{IMPULSE_AT_S, PERIOD_S};

/// How a controller answered one torque impulse.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Answer {
    /// [rad] largest angle.
    pub peak: f64,
    /// [s] from the impulse until the angle stays within 5 % of its peak.
    pub settling: f64,
    /// [%] largest angle on the other side, of the peak.
    pub overshoot_percent: f64,
    /// Times the angle swings through to the other side by more than 5 % of the peak.
    pub swings: usize,
    /// [rad s²] integral of time times the absolute angle.
    pub itae: f64,
    /// [N m] rms of the commanded torque.
    pub effort: f64,
    /// [N m] rms of estimated minus true disturbance torque.
    pub disturbance_error: f64,
    /// [N m] largest disturbance estimate.
    pub disturbance_peak: f64,
}

/// One period of a flight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment {
    /// [s] since the emulator began.
    pub time: f64,
    /// [rad] measured at the pivot, without noise.
    pub angle: f64,
    /// [N m] torque that the controller asks for.
    pub torque: f64,
    /// [N m] its estimate of the disturbance.
    pub estimate: f64,
    /// [N m] the disturbance.
    pub disturbance: f64,
}

/// Judges the flight from the impulse on. The angle is the true one, less what it was just before.
pub(super) fn judge(flight: &[Moment]) -> Answer {
    let start = flight.iter().position(|moment| moment.time >= IMPULSE_AT_S - 0.5 * PERIOD_S).unwrap_or(0);
    let judged = flight.get(start..).unwrap_or_default();
    let before = judged.first().map_or(0.0, |moment| moment.angle);
    let angle = |moment: &Moment| moment.angle - before;
    let largest = judged
        .iter()
        .map(angle)
        .fold(0.0, |most: f64, value| if value.abs() > most.abs() { value } else { most });
    let (peak, side) = (largest.abs(), largest.signum());
    let since = |moment: &Moment| moment.time - IMPULSE_AT_S;
    let settling = judged.iter().rev().find(|moment| angle(moment).abs() > 0.05 * peak).map_or(0.0, since);
    let overshoot = judged.iter().map(|moment| -side * angle(moment)).fold(0.0, f64::max);
    let mut swings = 0;
    let mut last_side = side;
    for moment in judged.iter().filter(|moment| angle(moment).abs() > 0.05 * peak) {
        if angle(moment).signum() != last_side {
            swings += 1;
            last_side = -last_side;
        }
    }
    let rms = |value: &dyn Fn(&Moment) -> f64| {
        (judged.iter().map(|moment| value(moment).powi(2)).sum::<f64>() / judged.len().max(1) as f64).sqrt()
    };
    Answer {
        peak,
        settling,
        overshoot_percent: 100.0 * overshoot / peak.max(f64::MIN_POSITIVE),
        swings,
        itae: judged.iter().map(|moment| since(moment) * angle(moment).abs() * PERIOD_S).sum(),
        effort: rms(&|moment| moment.torque),
        disturbance_error: rms(&|moment| moment.estimate - moment.disturbance),
        disturbance_peak: judged.iter().map(|moment| moment.estimate.abs()).fold(0.0, f64::max),
    }
}
