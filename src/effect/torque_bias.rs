//! A constant torque.

use super::{Card, Law, Parameter, Site, Symmetry, Term, constant};
use crate::signal::columns::BODY_RATE;

/// The card.
pub(super) static CARD: Card = Card {
    id: "torque_bias",
    meaning: "A constant torque.",
    equation: "+τ_0",
    source: "unequal rotors, a taut cable, a steady draught",
    site: Site::Torque,
    parameters: &[Parameter {
        name: "torque",
        symbol: "τ_0",
        unit: "N m",
        lower: -20.0,
        upper: 20.0,
        start: 0.01,
        others: &[],
        neutral: 0.0,
        meaning: "the torque",
    }],
    law: Law::Static(constant),
    needs: &[BODY_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Constant),
    report: [
        "Something pushes the body with a constant torque.",
        "The controller has to hold against it all the time.",
    ],
    residual: "A constant unknown torque.",
    confused_with: &["actuator_mismatch", "gyro_bias"],
    experiment: "Two collectives: a mismatch of the rotors grows with thrust, a bias does not.",
};
