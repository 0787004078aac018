//! Rows that are levels of a thrust stand: they show where the rotor settles, and nothing of how it gets there.

use crate::screening::rotor_data::RotorLog;
use crate::screening::suspicion::{Stops, Suspicion};

/// Rows that are levels each.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let finding = rotor.finding("rows_are_levels").rows(rotor.time.len()).with("interval_s", rotor.interval);
    rotor.rows_are_levels().then_some(Suspicion { finding, stops: Stops::Searches })
}
