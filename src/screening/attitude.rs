//! Rate and angle of the body beside each other: one is the slope of the other, whatever their units are.

use super::Finding;
use super::plausibility::MOST;
use super::rotor_data::bounds;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::mean_of;
use crate::estimation::quantile::quantile;
use crate::log::Dataset;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

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

/// Rate and angle of a body whose units are asked for.
pub(crate) struct Attitude<'a> {
    log: &'a Dataset,
    /// [rad/s] the greatest rate, a few flipped bits apart.
    pub fastest: f64,
    /// [rad] what the angle spans; `None` where none is measured.
    pub span: Option<f64>,
    /// How many times the slope of the angle the rate is; `None` where it does not go with it.
    pub ratio: Option<f64>,
}

impl<'a> Attitude<'a> {
    /// That of a log with this rate [rad/s].
    pub(crate) fn of(log: &'a Dataset, rate: &[f64]) -> Self {
        let fastest = quantile(rate.iter().map(|rate| rate.abs()), MOST).unwrap_or(0.0);
        let angle = log.column(BODY_ANGLE);
        let span = angle.map(bounds).map(|(low, high)| high - low);
        Self { log, fastest, span, ratio: angle.and_then(|angle| ratio_to_slope(log.time(), angle, rate)) }
    }

    /// A finding in the rate.
    pub(crate) fn of_rate(&self, code: &'static str) -> Finding {
        Finding::new(code, BODY_RATE).of(self.log.source_name())
    }

    /// A finding in the angle.
    pub(crate) fn of_angle(&self, code: &'static str) -> Finding {
        Finding::new(code, BODY_ANGLE).of(self.log.source_name())
    }
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
