//! Samples between which a rotor has long settled.

use crate::screening::rotor_data::RotorLog;
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// Samples so far apart that the time is in another unit, or nothing can be seen.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let finding = rotor.finding("samples_too_far_apart").with("interval_s", rotor.interval);
    let finding =
        finding.with("most_rows", THRESHOLDS.most_levels).with("rows_a_level", THRESHOLDS.rows_of_a_level);
    let is_too_far = rotor.interval > THRESHOLDS.slowest_samples && !rotor.rows_are_levels();
    is_too_far.then_some(Suspicion::impossible(finding))
}
