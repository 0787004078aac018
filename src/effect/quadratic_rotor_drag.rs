//! The air brakes the rotor with the square of its speed.

use super::{Card, Law, Parameter, Point, Site, Symmetry};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "quadratic_rotor_drag",
    meaning: "The air brakes the rotor with the square of its speed.",
    equation: "p (z - ω_p) - k ω_p abs(ω_p)",
    source: "quadratic drag torque of a propeller in the torque balance of the motor",
    site: Site::RotorAcceleration,
    parameters: &[Parameter {
        name: "coefficient",
        symbol: "k",
        unit: "1/rad",
        lower: 0.0,
        upper: 0.5,
        start: 0.002,
        others: &[0.01],
        neutral: 0.0,
        meaning: "drag torque over rotor inertia and speed squared",
    }],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: true,
    acts_as: None,
    report: [
        "The air brakes the rotor with the square of its speed.",
        "The rotor then answers faster the faster it turns, and bends its static curve.",
    ],
    residual: "Transients whose error differs between low and high speed and between up and down, and a bent static curve.",
    confused_with: &["asymmetric_pole", "speed_dependent_pole", "static_cubic"],
    experiment: "Small steps up and down about several speeds: drag grows with speed, asymmetry does not.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [coefficient] = *parameters else { return 0.0 };
    -coefficient * point.propeller_rate * point.propeller_rate.abs()
}
