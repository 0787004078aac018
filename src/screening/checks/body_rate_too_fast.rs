//! A body rate that no body on a bench has.

use crate::screening::attitude::{Attitude, Mistaken};
use crate::screening::thresholds::THRESHOLDS;

/// A rate beyond what a gyroscope reads, with what the angle spans where one is measured.
pub(crate) fn check(attitude: &Attitude) -> Option<Mistaken> {
    let fastest = Some(attitude.fastest).filter(|fastest| *fastest > THRESHOLDS.greatest_body_rate)?;
    let finding = attitude.of_rate("body_rate_too_fast").with("greatest_rad_s", fastest);
    Some(Mistaken::Rate(match attitude.span {
        Some(span) => finding.with("angle_span_rad", span),
        None => finding,
    }))
}
