//! Rates with another sign than the commands.

use crate::screening::rotor_data::{LEAST_COMMAND, RotorLog, bounds};
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// Rates below zero, and not by noise: the column counts the other way round where most is there.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let (slowest, fastest) = bounds(&rotor.rate);
    let finding = rotor.finding("rate_negative").with("least_rad_s", slowest);
    let is_negative = slowest < -THRESHOLDS.negative_rate * fastest.abs();
    (is_negative && bounds(&rotor.command).1 >= LEAST_COMMAND)
        .then_some(Suspicion::impossible_if(fastest < -slowest, finding))
}
