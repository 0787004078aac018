//! The rotor speeds up and slows down at different rates.

use super::{Card, Law, Parameter, Point, Site, Symmetry};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "asymmetric_pole",
    meaning: "The rotor speeds up and slows down at different rates.",
    equation: "p r (z - ω_p) when z > ω_p, (p / r) (z - ω_p) when z < ω_p",
    source: "active acceleration against coasting of a motor without braking",
    site: Site::RotorAcceleration,
    parameters: &[Parameter {
        name: "ratio",
        symbol: "r",
        unit: "-",
        lower: 0.2,
        upper: 5.0,
        start: 1.2,
        others: &[0.8, 2.0],
        neutral: 1.0,
        meaning: "pole upwards over mean pole",
    }],
    law: Law::Static(add),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: true,
    needs_transients: true,
    acts_as: None,
    report: [
        "The rotor accelerates faster than it slows down, or the other way round.",
        "The motor drives it up, but only air and friction slow it down.",
    ],
    residual: "Transients only: the error of an up-step has the other sign than that of a down-step.",
    confused_with: &["quadratic_rotor_drag", "speed_dependent_pole"],
    experiment: "Steps of the same size up and down at a low and at a high speed: asymmetry is the same at both.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [ratio] = *parameters else { return 0.0 };
    let way = point.steady_rate - point.propeller_rate;
    let factor = if way > 0.0 { ratio } else { 1.0 / ratio };
    (factor - 1.0) * point.pole * way
}
