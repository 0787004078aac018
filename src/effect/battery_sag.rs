//! The rotor slows as the battery empties.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE, BATTERY_VOLTAGE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "battery_sag",
    meaning: "The rotor slows as the battery empties.",
    equation: "z - k_V (v_bmax - v_b)",
    source: "[LPC16] Eqs. (2), (6); **Deviation:** the sign of (6), which is the physical one",
    site: Site::SteadyRate,
    parameters: &[Parameter {
        name: "gain",
        symbol: "k_V",
        unit: "rad/(s V)",
        // A battery that gives way never makes a rotor faster.
        lower: 0.0,
        upper: 1e3,
        start: 10.0,
        others: &[],
        neutral: 0.0,
        meaning: "rate lost per volt",
    }],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE, BATTERY_VOLTAGE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::VoltageDrop),
    report: [
        "The same command turns the rotor more slowly when the battery is low.",
        "Each volt that is gone costs the same number of rad/s, whatever the command.",
    ],
    residual: "A slow drift that follows the battery voltage, the same at every command.",
    confused_with: &["battery_scaling", "motor_heating"],
    experiment: "Constant commands at two levels from full to empty battery: sag costs the same at both, scaling costs more at the higher one.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [gain] = *parameters else { return 0.0 };
    -gain * (point.full_voltage - point.battery_voltage)
}
