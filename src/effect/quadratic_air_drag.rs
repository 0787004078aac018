//! Air drag with the square of the rate.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::BODY_RATE;

/// The card.
pub(super) static CARD: Card = Card {
    id: "quadratic_air_drag",
    meaning: "Air drag with the square of the rate.",
    equation: "-c ω_b abs(ω_b)",
    source: "form drag of arms and body",
    site: Site::Torque,
    parameters: &[Parameter {
        name: "coefficient",
        symbol: "c",
        unit: "N m s^2/rad^2",
        lower: 0.0,
        upper: 20.0,
        start: 0.01,
        others: &[],
        neutral: 0.0,
        meaning: "torque per rate squared",
    }],
    law: Law::Static(add),
    needs: &[BODY_RATE],
    symmetry: Symmetry::Dissipative,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::QuadraticDrag),
    report: [
        "The air brakes fast turning much more than slow turning.",
        "Arms and body have to push the air aside.",
    ],
    residual: "An unknown torque that grows with the square of the body rate.",
    confused_with: &["pivot_viscous_friction", "pivot_coulomb_friction", "inflow_damping"],
    experiment: "A slow and a fast swing: air drag brakes only the fast one.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [coefficient] = *parameters else { return 0.0 };
    -coefficient * point.body_rate * point.body_rate.abs()
}
