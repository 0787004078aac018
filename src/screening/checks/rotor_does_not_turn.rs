//! Rates that are noise about zero while the rotor is commanded to turn.

use crate::estimation::quantile::median;
use crate::screening::plausibility::LEAST_HELD;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// A rotor that stands under its command: the command is another rotor's.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let (slowest, fastest) = bounds(&rotor.rate);
    if !stands(rotor, slowest, fastest) {
        return None;
    }
    let finding = rotor.finding("rotor_does_not_turn").with("greatest_command", bounds(&rotor.command).1);
    let finding = finding.with("least_rad_s", slowest).with("greatest_rad_s", fastest);
    Some(Suspicion::impossible(finding))
}

/// Whether the rates under command are noise about zero, `slowest` and `fastest` [rad/s] its ends.
fn stands(rotor: &RotorLog, slowest: f64, fastest: f64) -> bool {
    let ends = fastest.max(-slowest);
    if slowest >= -THRESHOLDS.negative_rate * fastest.abs() || ends > THRESHOLDS.standing_rate {
        return false;
    }
    let commanded = rotor.command.iter().zip(&rotor.rate).filter(|(command, _)| **command >= LEAST_HELD);
    median(commanded.map(|(_, rate)| *rate))
        .is_some_and(|middle| middle.abs() < THRESHOLDS.standing_middle * ends)
}
