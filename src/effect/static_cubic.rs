//! The static curve bends more than a parabola.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "static_cubic",
    meaning: "The static curve bends more than a parabola.",
    equation: "g(u) + c_3 (u - u_0)³",
    source: "[LPC16] Sec. III.A tries degrees 1 to 4",
    site: Site::SteadyRate,
    parameters: &[Parameter {
        name: "coefficient",
        symbol: "c_3",
        unit: "rad/s",
        lower: -2e5,
        upper: 2e5,
        start: 500.0,
        others: &[],
        neutral: 0.0,
        meaning: "the cubic term about the hover command",
    }],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Cubic),
    report: [
        "The static curve from command to speed bends more than the model allows.",
        "The error shows at the ends of the range, with opposite signs.",
    ],
    residual: "A static error, cubic in the command.",
    confused_with: &["static_offset", "command_dead_zone", "command_saturation", "quadratic_rotor_drag"],
    experiment: "A slow ramp over the whole range of commands.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [coefficient] = *parameters else { return 0.0 };
    coefficient * (point.command - point.hover_command).powi(3)
}
