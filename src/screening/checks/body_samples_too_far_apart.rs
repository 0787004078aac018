//! Rows between which a body has long moved and come back.

use crate::screening::attitude::{Attitude, Mistaken};
use crate::screening::thresholds::THRESHOLDS;

/// Rows so far apart that the time is in another unit, or nothing can be seen.
pub(crate) fn check(attitude: &Attitude) -> Option<Mistaken> {
    let interval = Some(attitude.interval()).filter(|interval| *interval > THRESHOLDS.sparsest_attitude)?;
    Some(Mistaken::Time(attitude.of_rate("samples_too_far_apart").with("interval_s", interval)))
}
