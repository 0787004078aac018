//! A rotor that moves into its own wake pushes less.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::{BODY_RATE, PROPELLER_RATES};

/// The card.
pub(super) static CARD: Card = Card {
    id: "inflow_damping",
    meaning: "A rotor that moves into its own wake pushes less.",
    equation: "f - k c ω_p v, v = ±d ω_b",
    source: "blade-element theory: thrust falls with axial inflow",
    site: Site::Thrust,
    parameters: &[Parameter {
        name: "coefficient",
        symbol: "k",
        unit: "-",
        lower: 0.0,
        upper: 100.0,
        start: 0.5,
        others: &[],
        neutral: 0.0,
        meaning: "thrust lost per speed, over c ω_p",
    }],
    law: Law::Static(add),
    needs: &[BODY_RATE, PROPELLER_RATES[0], PROPELLER_RATES[1]],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::AxialDamping),
    report: [
        "The rotor that moves up pushes less and the one that moves down pushes more, so the body is damped.",
        "The damping grows with the speed of the rotors and vanishes when they stand.",
    ],
    residual: "An unknown torque in proportion to body rate times rotor rate.",
    confused_with: &["pivot_viscous_friction"],
    experiment: "Swings at a low and at a high collective: inflow damping grows with it, friction does not.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [coefficient] = *parameters else { return 0.0 };
    let own_speed = point.side * point.arm * point.body_rate;
    -coefficient * point.thrust_coefficient * point.propeller_rate * own_speed
}
