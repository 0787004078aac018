//! Small commands do nothing.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "command_dead_zone",
    meaning: "Small commands do nothing.",
    equation: "u' = max(0, u - u_d) / (1 - u_d)",
    source: "idle threshold of speed controllers",
    site: Site::Command,
    parameters: &[Parameter {
        name: "width",
        symbol: "u_d",
        unit: "-",
        lower: 0.0,
        upper: 0.6,
        start: 0.03,
        others: &[0.1, 0.25],
        neutral: 0.0,
        meaning: "command below which nothing happens",
    }],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::DeadZone),
    report: [
        "Below a threshold the command does nothing, above it the rest of the range is stretched.",
        "The speed controller keeps the lowest part of its range for itself.",
    ],
    residual: "A static error that is largest at small commands.",
    confused_with: &["static_offset", "static_cubic"],
    experiment: "A slow ramp from zero to half command.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [width] = *parameters else { return 0.0 };
    (point.command - width).max(0.0) / (1.0 - width) - point.command
}
