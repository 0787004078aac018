//! Rate and angle of the body in units that are not those of their names: one is the slope of the other.

use super::Finding;
use super::channel::{BODY_ANGLE, BODY_RATE};
use super::plausibility::MOST;
use super::rotor_data::bounds;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::mean_of;
use crate::estimation::quantile::quantile;
use crate::log::Dataset;

/// Around 180/π: as far as noise and the lag of a sensor can move the ratio of a rate to the slope of its angle.
pub const DEGREES: std::ops::Range<f64> = THRESHOLDS.degrees_least..THRESHOLDS.degrees_greatest;

/// What is wrong.
pub(crate) enum Mistaken {
    /// The rate, or the time, is not in its unit.
    Rate(Finding),
    /// The angle is not, and the rate is.
    Angle(Finding),
    /// Both may be: a body without stops may well turn over.
    Perhaps(Finding),
}

/// The rate [rad/s] against the angle's own slope: a factor of 57 is a unit.
pub(crate) fn mistaken(log: &Dataset, rate: &[f64]) -> Option<Mistaken> {
    let finding = |code, channel: &str| Finding::new(code, channel).of(log.source_name());
    // A few flipped bits are no rate.
    let fastest = quantile(rate.iter().map(|rate| rate.abs()), MOST).unwrap_or(0.0);
    let too_fast = finding("body_rate_too_fast", BODY_RATE).with("greatest_rad_s", fastest);
    let Some(angle) = log.column(BODY_ANGLE) else {
        return (fastest > THRESHOLDS.greatest_body_rate).then_some(Mistaken::Rate(too_fast));
    };
    let (low, high) = bounds(angle);
    let ratio = ratio_to_slope(log.time(), angle, rate);
    if let Some(ratio) = ratio.filter(|ratio| DEGREES.contains(ratio)) {
        return Some(Mistaken::Rate(finding("body_rate_in_degrees", BODY_RATE).with("ratio", ratio)));
    }
    if let Some(ratio) = ratio
        .filter(|ratio| (THRESHOLDS.milliseconds_least..THRESHOLDS.milliseconds_greatest).contains(ratio))
    {
        return Some(Mistaken::Rate(finding("time_in_milliseconds", BODY_RATE).with("ratio", ratio)));
    }
    if fastest > THRESHOLDS.greatest_body_rate {
        return Some(Mistaken::Rate(too_fast.with("angle_span_rad", high - low)));
    }
    if let Some(ratio) = ratio.filter(|ratio| DEGREES.contains(&(1.0 / ratio))) {
        return Some(Mistaken::Angle(
            finding("body_angle_in_degrees", BODY_ANGLE).with("ratio", 1.0 / ratio),
        ));
    }
    let turns_over = finding("body_turns_over", BODY_ANGLE).with("angle_span_rad", high - low);
    (high - low > std::f64::consts::TAU).then_some(Mistaken::Perhaps(turns_over))
}

/// How many times the slope of the angle [rad] the rate is; `None` where it does not go with it. From reading to reading of
/// the angle, a while apart, against the rate's mean meanwhile.
fn ratio_to_slope(time: &[f64], angle: &[f64], rate: &[f64]) -> Option<f64> {
    let (mut slopes, mut means, mut both) = (0.0, 0.0, 0.0);
    let mut from = None::<usize>;
    for row in (0..time.len()).filter(|row| angle[*row].is_finite()) {
        let Some(first) = from else {
            from = Some(row);
            continue;
        };
        let span = time[row] - time[first];
        if span < THRESHOLDS.slope_span {
            continue;
        }
        from = Some(row);
        let known = || rate[first..=row].iter().filter(|rate| rate.is_finite());
        let (slope, mean) = ((angle[row] - angle[first]) / span, mean_of(known().copied()));
        if mean.is_finite()
            && span < THRESHOLDS.slope_span_longest * THRESHOLDS.slope_span.max(time[row] - time[row - 1])
        {
            slopes += slope * slope;
            means += mean * mean;
            both += slope * mean;
        }
    }
    (both.abs() > THRESHOLDS.slope_correlation * (slopes * means).sqrt()).then(|| (means / slopes).sqrt())
}
