//! The gyroscope reads in a wrong scale.

use super::{Card, Law, Parameter, Point, Site, Symmetry};
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "gyro_scale",
    meaning: "The gyroscope reads in a wrong scale.",
    equation: "y = s ω_b",
    source: "scale error of the sensor or of its driver",
    site: Site::BodyRateSensor,
    parameters: &[Parameter {
        name: "scale",
        symbol: "s",
        unit: "-",
        lower: 0.1,
        upper: 10.0,
        start: 1.05,
        others: &[0.9],
        neutral: 1.0,
        meaning: "reading over truth",
    }],
    law: Law::Static(add),
    needs: &[BODY_RATE, BODY_ANGLE],
    symmetry: Symmetry::OddInBodyMotion,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: None,
    report: [
        "The gyroscope reads too much or too little by a fixed share.",
        "The measured angle moves by another amount than the gyroscope says.",
    ],
    residual: "A difference between the body rate and the slope of the measured angle, in proportion to the rate.",
    confused_with: &[],
    experiment: "Turn the body by a known angle and integrate the gyroscope.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [scale] = *parameters else { return 0.0 };
    (scale - 1.0) * point.body_rate
}
