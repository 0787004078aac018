//! A body angle of more than a turn.

use crate::screening::attitude::{Attitude, Mistaken};

/// An angle that spans more than a turn: a body without stops, or angle and rate in degrees both.
pub(crate) fn check(attitude: &Attitude) -> Option<Mistaken> {
    let span = attitude.span.filter(|span| *span > std::f64::consts::TAU)?;
    Some(Mistaken::Perhaps(attitude.of_angle("body_turns_over").with("angle_span_rad", span)))
}
