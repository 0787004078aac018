//! Rate and angle of the body in units that are not those of their names.

use super::attitude::{Attitude, Mistaken};
use super::checks::BODY_UNITS;
use crate::log::Dataset;

/// What is wrong with the units of a log with this rate [rad/s]: a factor of 57 between it and the slope of the angle is a unit.
pub(crate) fn mistaken(log: &Dataset, rate: &[f64]) -> Option<Mistaken> {
    let attitude = Attitude::of(log, rate);
    BODY_UNITS.iter().find_map(|check| check(&attitude))
}
