//! Friction in proportion to the rate.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::BODY_RATE;

/// The card.
pub(super) static CARD: Card = Card {
    id: "pivot_viscous_friction",
    meaning: "Friction in proportion to the rate.",
    equation: "-b ω_b",
    source: "lubricated bearing",
    site: Site::Torque,
    parameters: &[Parameter {
        name: "coefficient",
        symbol: "b",
        unit: "N m s/rad",
        lower: 0.0,
        upper: 10.0,
        start: 0.01,
        others: &[],
        neutral: 0.0,
        meaning: "torque per rate",
    }],
    law: Law::Static(add),
    needs: &[BODY_RATE],
    symmetry: Symmetry::Dissipative,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::ViscousFriction),
    report: [
        "The body is braked in proportion to its rate.",
        "Oil in the bearing, or the rotors' inflow, acts like this.",
    ],
    residual: "An unknown torque in proportion to the body rate.",
    confused_with: &["inflow_damping", "pivot_coulomb_friction", "quadratic_air_drag"],
    experiment: "Free swings with rotors off and on: inflow damping needs turning rotors.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [coefficient] = *parameters else { return 0.0 };
    -coefficient * point.body_rate
}
