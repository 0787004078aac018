//! A body angle whose slope is some 57 times the body's rate.

use crate::screening::attitude::{Attitude, DEGREES, Mistaken};

/// An angle in degrees beside a rate in radians a second.
pub(crate) fn check(attitude: &Attitude) -> Option<Mistaken> {
    let ratio = 1.0 / attitude.ratio.filter(|ratio| DEGREES.contains(&(1.0 / ratio)))?;
    Some(Mistaken::Angle(attitude.of_angle("body_angle_in_degrees").with("ratio", ratio)))
}
