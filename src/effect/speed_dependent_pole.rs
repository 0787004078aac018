//! The rotor answers faster at high speed than at low speed.

use super::thresholds::THRESHOLDS;
use super::{Card, Law, Parameter, Point, Site, Symmetry};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "speed_dependent_pole",
    meaning: "The rotor answers faster at high speed than at low speed.",
    equation: "p (1 + κ (ω_p - ω_0) / ω_0) (z - ω_p)",
    source: "linearization of the quadratic air torque about several speeds",
    site: Site::RotorAcceleration,
    parameters: &[Parameter {
        name: "slope",
        symbol: "κ",
        unit: "-",
        lower: -2.0,
        upper: 2.0,
        start: 0.2,
        others: &[-0.2],
        neutral: 0.0,
        meaning: "relative growth of the pole per relative growth of the speed",
    }],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: true,
    acts_as: None,
    report: [
        "The rotor answers at another pace at high speed than at low speed.",
        "The air damps a fast rotor more than a slow one.",
    ],
    residual: "Transients only: their error changes sign between low and high speed.",
    confused_with: &["quadratic_rotor_drag", "asymmetric_pole"],
    experiment: "Small steps about several speeds.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [slope] = *parameters else { return 0.0 };
    // The division waits for nothing that moves: a step goes on beside it.
    let factor = 1.0 + slope / point.hover_rate * (point.propeller_rate - point.hover_rate);
    (factor.max(THRESHOLDS.smallest_pole_factor) - 1.0)
        * point.pole
        * (point.steady_rate - point.propeller_rate)
}
