//! Commands that are not from 0 to 1.

use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// Commands beyond 0 or 1: percent, or a pulse in microseconds, where they are far beyond.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let (low, high) = bounds(&rotor.command);
    let is_impossible = high > THRESHOLDS.impossible_command;
    let finding = rotor.finding("command_out_of_range").with("least", low).with("greatest", high);
    (high > 1.0 + 1e-9 || low < -1e-9).then_some(Suspicion::impossible_if(is_impossible, finding))
}
