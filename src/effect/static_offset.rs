//! The static curve is shifted.

use super::{Card, Law, Parameter, Site, Symmetry, Term, constant};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "static_offset",
    meaning: "The static curve is shifted.",
    equation: "g(u) + c_0",
    source: "identified curves seldom pass through the origin",
    site: Site::SteadyRate,
    parameters: &[Parameter {
        name: "coefficient",
        symbol: "c_0",
        unit: "rad/s",
        lower: -2e3,
        upper: 2e3,
        start: 5.0,
        others: &[],
        neutral: 0.0,
        meaning: "the shift",
    }],
    law: Law::Static(constant),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Constant),
    report: [
        "The rotor turns faster or slower than the model by the same amount at every command.",
        "The static curve of the model is forced through the origin, the true one is not.",
    ],
    residual: "A constant error.",
    confused_with: &["static_cubic", "command_dead_zone"],
    experiment: "A slow ramp over the whole range of commands.",
};
