//! The gyroscope is off by a constant.

use super::{Card, Law, Parameter, Site, Symmetry, Term, constant};
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "gyro_bias",
    meaning: "The gyroscope is off by a constant.",
    equation: "y = ω_b + β",
    source: "zero-rate offset of the sensor",
    site: Site::BodyRateSensor,
    parameters: &[Parameter {
        name: "bias",
        symbol: "β",
        unit: "rad/s",
        lower: -3.0,
        upper: 3.0,
        start: 0.01,
        others: &[],
        neutral: 0.0,
        meaning: "reading at rest",
    }],
    law: Law::Static(constant),
    needs: &[BODY_RATE, BODY_ANGLE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Constant),
    report: [
        "The gyroscope reads a constant rate when the body rests.",
        "An angle integrated from it walks away.",
    ],
    residual: "A constant difference between the body rate and the slope of the measured angle.",
    confused_with: &["torque_bias"],
    experiment: "Rest with the rotors off and read the gyroscope.",
};
