//! Rate and angle of the body beside each other: one is the slope of the other, whatever their units are.

use super::Finding;
use super::plausibility::MOST;
use super::rotor_data::bounds;
use super::suspicion::{Stops, Suspicion};
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::mean_of;
use crate::estimation::quantile::quantile;
use crate::log::Dataset;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// Around 180/π: as far as noise and the lag of a sensor can move the ratio of a rate to the slope of its angle.
pub const DEGREES: std::ops::Range<f64> = THRESHOLDS.degrees_least..THRESHOLDS.degrees_greatest;

/// What is wrong.
#[derive(Debug, Clone)]
pub(crate) enum Mistaken {
    /// The rate, or the time, is not in its unit.
    Rate(Finding),
    /// The angle is not, and the rate is.
    Angle(Finding),
    /// Both may be: a body without stops may well turn over.
    Perhaps(Finding),
    /// The time is in another unit, or its rows are too far apart.
    Time(Finding),
}

impl Mistaken {
    /// What it is, and by which numbers.
    pub(crate) fn finding(&self) -> &Finding {
        match self {
            Self::Rate(finding) | Self::Angle(finding) | Self::Perhaps(finding) | Self::Time(finding) => {
                finding
            }
        }
    }

    /// Who cannot work with it. Rotors are identified beside a body whose units are wrong, and J is not.
    pub(crate) fn suspicion(&self) -> Suspicion {
        let stops = match self {
            Self::Rate(_) | Self::Angle(_) => Stops::Searches,
            Self::Perhaps(_) => Stops::Nobody,
            Self::Time(_) => Stops::Fits,
        };
        Suspicion { finding: self.finding().clone(), stops }
    }
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

    /// [s] median time between two rows.
    pub(crate) fn interval(&self) -> f64 {
        self.log.median_interval()
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

/// An inertia `found` [kg m²] that is as much smaller than the model's as a degree is than a radian: of a log in whose units nothing
/// else shows, for rate and angle are in degrees both, or no angle was measured.
pub(crate) fn inertia_in_degrees(of_model: f64, found: f64) -> Option<Finding> {
    let finding = Finding::new("inertia_in_degrees", "inertia").with("inertia_kg_m2", found);
    DEGREES.contains(&(of_model / found)).then(|| finding.with("template_kg_m2", of_model))
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
