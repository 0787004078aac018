//! Commands above a limit do nothing more.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "command_saturation",
    meaning: "Commands above a limit do nothing more.",
    equation: "u' = min(u, u_max)",
    source: "current or duty limit of the speed controller",
    site: Site::Command,
    parameters: &[Parameter {
        name: "limit",
        symbol: "u_max",
        unit: "-",
        lower: 0.02,
        upper: 1.0,
        start: 0.8,
        others: &[0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.9],
        neutral: 1.0,
        meaning: "largest command that has effect",
    }],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Saturation),
    report: [
        "Above a limit the rotor does not answer to more command.",
        "The speed controller or the battery has reached its limit.",
    ],
    residual: "The rotor stays below the model at large commands and only there.",
    confused_with: &["static_cubic", "battery_scaling"],
    experiment: "A slow ramp to full command.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [limit] = *parameters else { return 0.0 };
    point.command.min(limit) - point.command
}
