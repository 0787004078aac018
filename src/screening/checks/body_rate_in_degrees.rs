//! A body rate that is some 57 times the slope of the body's angle.

use crate::screening::attitude::{Attitude, DEGREES, Mistaken};

/// A rate in degrees a second beside an angle in radians.
pub(crate) fn check(attitude: &Attitude) -> Option<Mistaken> {
    let ratio = attitude.ratio.filter(|ratio| DEGREES.contains(ratio))?;
    Some(Mistaken::Rate(attitude.of_rate("body_rate_in_degrees").with("ratio", ratio)))
}
