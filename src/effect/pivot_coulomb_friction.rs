//! Dry friction in the pivot.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term, tanh};
use crate::signal::columns::BODY_RATE;

/// The card.
pub(super) static CARD: Card = Card {
    id: "pivot_coulomb_friction",
    meaning: "Dry friction in the pivot.",
    equation: "-τ_c tanh(ω_b/ω_s)",
    source: "Coulomb friction, smoothed at standstill",
    site: Site::Torque,
    parameters: &[
        Parameter {
            name: "torque",
            symbol: "τ_c",
            unit: "N m",
            lower: 0.0,
            upper: 10.0,
            start: 0.02,
            others: &[],
            neutral: 0.0,
            meaning: "friction torque",
        },
        Parameter {
            name: "smoothing_rate",
            symbol: "ω_s",
            unit: "rad/s",
            lower: 0.002,
            upper: 0.3,
            start: 0.03,
            others: &[],
            neutral: f64::NAN,
            meaning: "rate over which it turns round",
        },
    ],
    law: Law::Stiff(add),
    needs: &[BODY_RATE],
    symmetry: Symmetry::Dissipative,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::CoulombFriction),
    report: [
        "The pivot rubs: it brakes with the same torque however slowly the body turns.",
        "Small torques do not move the body at all.",
    ],
    residual: "An unknown torque that switches sign with the body rate and keeps its size.",
    confused_with: &["pivot_viscous_friction", "quadratic_air_drag"],
    experiment: "A slow and a fast swing: dry friction brakes both alike.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [torque, smoothing_rate] = *parameters else { return 0.0 };
    -torque * tanh(point.body_rate / smoothing_rate)
}
