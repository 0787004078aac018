//! One rotor pushes harder than the other.

use super::{Card, Law, Parameter, Point, Site, Symmetry};
use crate::signal::columns::{BODY_RATE, PROPELLER_RATES};

/// The card.
pub(super) static CARD: Card = Card {
    id: "actuator_mismatch",
    meaning: "One rotor pushes harder than the other.",
    equation: "f_1 (1 + ε), f_2 (1 - ε)",
    source: "spread of propellers and motors",
    site: Site::Thrust,
    parameters: &[Parameter {
        name: "ratio",
        symbol: "ε",
        unit: "-",
        lower: -0.9,
        upper: 0.9,
        start: 0.02,
        others: &[],
        neutral: 0.0,
        meaning: "half the relative difference",
    }],
    law: Law::Static(add),
    needs: &[BODY_RATE, PROPELLER_RATES[0], PROPELLER_RATES[1]],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: None,
    report: [
        "At the same speed one rotor pushes harder than the other.",
        "A nicked or flexed propeller is enough.",
    ],
    residual: "An unknown torque in proportion to the sum of the thrusts.",
    confused_with: &["torque_bias"],
    experiment: "Two collectives: a mismatch grows with thrust, a torque bias does not.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [ratio] = *parameters else { return 0.0 };
    point.side * ratio * point.thrust
}
