//! Torques of the body's own that J alone leaves out: one that goes with its angle, as gravity's or a cable's, and one that
//! goes with its rate, as friction's. They bend J when they are not fitted beside it, by more than noise explains.

use super::thresholds::THRESHOLDS;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Estimate;
use crate::estimation::least_squares::{self, LinearFit};
use crate::signal::Channel;

/// A torque that is missing, and what J would be with it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OmittedTorque {
    /// What it goes with: `body_angle` or `body_rate`.
    pub goes_with: &'static str,
    /// [-] how many standard errors it shows with.
    pub shows: f64,
    /// [kg m²] J beside it, and beside the other one.
    pub inertia: Estimate,
}

/// What `alone`, a fit on the first two columns (d/J and a bias), leaves out; behind them are the integrals of rate and angle over
/// time. With it comes the d/J beside them.
pub(crate) fn find(
    (design, instruments, y): (&DMatrix<f64>, &DMatrix<f64>, &DVector<f64>),
    alone: &LinearFit,
) -> Option<(&'static str, f64, Estimate)> {
    let fit = least_squares::instrumental(design.as_view(), instruments.as_view(), y)?;
    let shows = |index: usize| fit.coefficients[index].abs() / fit.standard_error(index);
    let (what, shows) = if shows(2) > shows(3) {
        (Channel::BodyRate.name(), shows(2))
    } else {
        (Channel::BodyAngle.name(), shows(3))
    };
    let moved = (fit.coefficients[0] - alone.coefficients[0]).abs();
    let matters = moved > THRESHOLDS.omitted_torque_shift * alone.standard_error(0)
        && shows > THRESHOLDS.omitted_torque_errors
        && shows.is_finite();
    let slope = Estimate { value: fit.coefficients[0], standard_error: fit.standard_error(0) };
    (matters && slope.value > 0.0).then_some((what, shows, slope))
}
