//! A body rate that is some 1000 times the slope of the body's angle.

use crate::screening::attitude::{Attitude, Mistaken};
use crate::screening::thresholds::THRESHOLDS;

/// A time in milliseconds: all slopes are a thousandth.
pub(crate) fn check(attitude: &Attitude) -> Option<Mistaken> {
    let around = THRESHOLDS.milliseconds_least..THRESHOLDS.milliseconds_greatest;
    let ratio = attitude.ratio.filter(|ratio| around.contains(ratio))?;
    Some(Mistaken::Time(attitude.of_rate("time_in_milliseconds").with("ratio", ratio)))
}
