//! How a controller answered a torque impulse: one measure for `paper` and for `compare --runs`.

use serde::Serialize;

use crate::estimation::moments::mean_square;

use super::thresholds::THRESHOLDS;

/// How a controller answered one torque impulse.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ImpulseResponse {
    /// [rad] largest angle.
    pub peak: f64,
    /// [s] from the impulse until the angle stays within 5 % of its peak.
    pub settling: f64,
    /// Whether it stayed there for the last twentieth of that time, at least.
    pub settled: bool,
    /// [%] largest angle on the other side, of the peak.
    pub overshoot_percent: f64,
    /// Times the angle swings through to the other side by more than 5 % of the peak.
    pub swings: usize,
    /// [rad s²] integral of time times the absolute angle.
    pub itae: f64,
    /// [N m] rms of the commanded torque.
    pub effort: f64,
    /// [N m] rms of estimated minus true disturbance torque; absent where nobody knows the true one.
    pub disturbance_error: Option<f64>,
    /// [N m] largest disturbance estimate.
    pub disturbance_peak: f64,
}

/// One period of a run.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// [s] on the run's own clock.
    pub time: f64,
    /// [rad] angle, less its reference.
    pub angle: f64,
    /// [N m] torque that the controller asks for.
    pub torque: f64,
    /// [N m] its estimate of the disturbance.
    pub estimate: f64,
    /// [N m] the disturbance; not-a-number where nobody knows it.
    pub disturbance: f64,
}

/// Measures the response in `run` for `window_s` [s] from the impulse at `struck_s` [s] on. Angles are counted from what the angle was
/// just before.
#[must_use]
pub fn measure(run: &[Moment], struck_s: f64, window_s: f64) -> ImpulseResponse {
    let period = period_of(run);
    let first = run.partition_point(|moment| moment.time < struck_s - 0.5 * period);
    let behind = run.partition_point(|moment| moment.time < struck_s + window_s - 0.5 * period);
    let window = run.get(first..behind).unwrap_or_default();
    let before = window.first().map_or(0.0, |moment| moment.angle);
    let angle = |moment: &Moment| moment.angle - before;
    let largest = window
        .iter()
        .map(angle)
        .fold(0.0, |most: f64, value| if value.abs() > most.abs() { value } else { most });
    let (peak, side) = (largest.abs(), largest.signum());
    let since = |moment: &Moment| moment.time - struck_s;
    let settling = window
        .iter()
        .rev()
        .find(|moment| angle(moment).abs() > THRESHOLDS.settled_share * peak)
        .map_or(0.0, since);
    let settled = window.last().is_some_and(|last| settling < (1.0 - THRESHOLDS.held_share) * since(last));
    let overshoot = window.iter().map(|moment| -side * angle(moment)).fold(0.0, f64::max);
    let mut swings = 0;
    let mut last_side = side;
    for moment in window.iter().filter(|moment| angle(moment).abs() > THRESHOLDS.settled_share * peak) {
        if angle(moment).signum() != last_side {
            swings += 1;
            last_side = -last_side;
        }
    }
    let rms = |value: &dyn Fn(&Moment) -> f64| mean_square(window.iter().map(value)).sqrt();
    let disturbance_error = rms(&|moment| moment.estimate - moment.disturbance);
    ImpulseResponse {
        peak,
        settling,
        settled,
        overshoot_percent: 100.0 * overshoot / peak.max(f64::MIN_POSITIVE),
        swings,
        itae: window.iter().map(|moment| since(moment) * angle(moment).abs() * period).sum(),
        effort: rms(&|moment| moment.torque),
        disturbance_error: disturbance_error.is_finite().then_some(disturbance_error),
        disturbance_peak: window.iter().map(|moment| moment.estimate.abs()).fold(0.0, f64::max),
    }
}

/// [s] mean distance of two moments.
fn period_of(run: &[Moment]) -> f64 {
    match (run.first(), run.last()) {
        (Some(first), Some(last)) if run.len() > 1 => (last.time - first.time) / (run.len() - 1) as f64,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(angle: impl Fn(f64) -> f64) -> Vec<Moment> {
        let times = (0..2000).map(|k| f64::from(k) * 0.01);
        times
            .map(|time| Moment {
                time,
                angle: 0.3 + angle(time - 5.0),
                torque: if time < 5.0 { 7.0 } else { 2.0 },
                estimate: 0.25,
                disturbance: 0.05,
            })
            .collect()
    }

    #[test]
    fn a_damped_swing_is_counted_and_measured() {
        // e^(-t) sin 2t: peak at tan 2t = 2, t = 0.5536; then a half-turn, π/2 s, apart and e^(-π/2) smaller each.
        let swing = |t: f64| if t < 0.0 { 0.0 } else { (-t).exp() * (2.0 * t).sin() };
        let answer = measure(&run(swing), 5.0, 8.0);
        let peak = (-0.5536f64).exp() * (2.0f64 * 0.5536).sin();
        assert!((answer.peak - peak).abs() < 1e-4, "{answer:?}");
        assert!((answer.overshoot_percent - 100.0 * (-std::f64::consts::FRAC_PI_2).exp()).abs() < 0.1);
        // Halves of 1, 0.208, 0.043 of the peak: one swing to the other side is above 5 %.
        assert_eq!(answer.swings, 1);
        // The second half ends at t = π; within 5 % somewhat before.
        assert!((2.5..std::f64::consts::PI).contains(&answer.settling), "{answer:?}");
        // Rounding of sums of eight hundred squares.
        let error = answer.disturbance_error.unwrap_or(f64::NAN);
        assert!((answer.effort - 2.0).abs() < 1e-12 && (error - 0.2).abs() < 1e-12, "{answer:?}");
        assert!(answer.settled && !measure(&run(swing), 5.0, 1.0).settled);
        // It passes through zero at 8π/5 = 5.03, close to the end.
        assert!(!measure(&run(|t| if t < 0.0 { 0.0 } else { (2.5 * t).sin() }), 5.0, 5.04).settled);
        // Only what is asked for counts: the same run, cut before its overshoot.
        assert_eq!(measure(&run(swing), 5.0, 1.0).overshoot_percent, 0.0);
    }

    #[test]
    fn an_unknown_disturbance_is_no_number() {
        let mut run = run(|_| 0.0);
        run.iter_mut().for_each(|moment| moment.disturbance = f64::NAN);
        assert_eq!(measure(&run, 5.0, 8.0).disturbance_error, None);
        assert_eq!(measure(&[], 5.0, 8.0).peak, 0.0);
    }
}
