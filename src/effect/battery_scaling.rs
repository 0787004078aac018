//! The speed controller puts a share of the battery voltage on the motor, so the command scales with the battery.

use super::{Card, Law, Point, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE, BATTERY_VOLTAGE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "battery_scaling",
    meaning: "The speed controller puts a share of the battery voltage on the motor, so the command scales with the battery.",
    equation: "z = g(u v_b / v_bmax)",
    source: "averaged model of a pulse-width-modulated inverter",
    site: Site::Command,
    parameters: &[],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE, BATTERY_VOLTAGE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::VoltageScaling),
    report: [
        "The command is a share of the battery voltage, so an emptying battery shrinks every command.",
        "The loss grows with the command; at rest the battery does not matter.",
    ],
    residual: "A drift that follows the battery voltage and grows with the command.",
    confused_with: &["battery_sag", "motor_heating"],
    experiment: "Constant commands at two levels from full to empty battery: scaling costs more at the higher one, sag the same at both.",
};

fn add(_: &[f64], point: &Point) -> f64 {
    // Without a known full voltage the law cannot scale.
    if point.full_voltage > 0.0 {
        point.command * (point.battery_voltage / point.full_voltage - 1.0)
    } else {
        0.0
    }
}
