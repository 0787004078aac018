//! The command takes effect only in steps.

use super::{Card, Law, Parameter, Point, Site, Symmetry};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "command_quantization",
    meaning: "The command takes effect only in steps.",
    equation: "u' on a grid of step Δ",
    source: "word length of the link to the speed controller",
    site: Site::Command,
    parameters: &[Parameter {
        name: "step",
        symbol: "Δ",
        unit: "-",
        lower: 0.0,
        upper: 0.3,
        start: 0.01,
        others: &[],
        neutral: 0.0,
        meaning: "step of the grid",
    }],
    law: Law::PiecewiseConstant(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: None,
    report: [
        "The speed controller rounds the command to a coarse grid.",
        "Slow changes of the command move the rotor in jumps.",
    ],
    residual: "A saw-tooth error against the command.",
    confused_with: &[],
    experiment: "A slow ramp: the rotor climbs stairs.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [step] = *parameters else { return 0.0 };
    if step > 0.0 { (point.command / step).round() * step - point.command } else { 0.0 }
}
