//! Rates that hardly any propeller has.

use crate::estimation::quantile::quantile;
use crate::screening::plausibility::MOST;
use crate::screening::rotor_data::RotorLog;
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// Rates that are rpm rather than rad/s, or electrical ones. Readings that a flipped bit wrote are outliers; here most of the upper
/// hundredth counts.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let fastest = quantile(rotor.rate.iter().copied(), MOST).unwrap_or(0.0);
    let is_impossible = fastest > THRESHOLDS.impossible_rate;
    let finding = rotor.finding("rate_too_fast").with("greatest_rad_s", fastest);
    (fastest > THRESHOLDS.fast_rate).then_some(Suspicion::impossible_if(is_impossible, finding))
}
