//! A rotor near the floor pushes harder.

use super::thresholds::THRESHOLDS;
use super::{Card, Law, Parameter, Point, Site, Symmetry, sin};
use crate::signal::columns::{BODY_ANGLE, BODY_RATE, PROPELLER_RATES};

/// The card.
pub(super) static CARD: Card = Card {
    id: "ground_effect",
    meaning: "A rotor near the floor pushes harder.",
    equation: "f / (1 - (R/(4 h))²), h = h_0 ± d sin θ",
    source: "Cheeseman and Bennett, 1955",
    site: Site::Thrust,
    parameters: &[
        Parameter {
            name: "radius",
            symbol: "R",
            unit: "m",
            lower: 0.005,
            upper: 1.0,
            start: 0.12,
            others: &[0.3],
            neutral: f64::NAN,
            meaning: "radius of the rotor",
        },
        Parameter {
            name: "height",
            symbol: "h_0",
            unit: "m",
            lower: 0.02,
            upper: 5.0,
            start: 0.35,
            others: &[0.15],
            neutral: f64::NAN,
            meaning: "height of the axis above the floor",
        },
    ],
    law: Law::Static(add),
    needs: &[BODY_RATE, BODY_ANGLE, PROPELLER_RATES[0], PROPELLER_RATES[1]],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: None,
    report: [
        "The rotor that comes near the floor pushes harder.",
        "The floor gives the body a spring towards level.",
    ],
    residual: "An unknown torque that grows steeply with the body angle and with thrust.",
    confused_with: &["cable_stiffness", "gravity_pendulum"],
    experiment: "Repeat at another height above the floor.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [radius, height] = *parameters else { return 0.0 };
    let own_height = height + point.side * point.arm * sin(point.body_angle);
    let ratio = (radius / (4.0 * own_height.max(0.0))).min(THRESHOLDS.largest_ground_ratio);
    point.thrust * (1.0 / (1.0 - ratio * ratio) - 1.0)
}
