//! The gyroscope is filtered.

use super::{Card, Law, Parameter, Site, Symmetry, Term};

/// The card.
pub(super) static CARD: Card = Card {
    id: "gyro_lag",
    meaning: "The gyroscope is filtered.",
    equation: "y' = p_g (ω_b - y)",
    source: "low-pass in the sensor",
    site: Site::BodyRateSensor,
    parameters: &[Parameter {
        name: "pole",
        symbol: "p_g",
        unit: "rad/s",
        lower: 2.0,
        upper: 2e3,
        start: 60.0,
        others: &[20.0, 200.0],
        neutral: f64::INFINITY,
        meaning: "pole of the filter",
    }],
    law: Law::Memory(lag!(body_rate, slow: false)),
    needs: &["body_rate_rad_s"],
    symmetry: Symmetry::None,
    acts_as: Some(Term::Lag),
    report: [
        "The gyroscope follows the true rate with a lag.",
        "The low-pass in the sensor is slower than the model assumes.",
    ],
    residual: "An error in proportion to the body's acceleration.",
    confused_with: &["rotor_lag", "torque_delay"],
    experiment: "An encoder beside the gyroscope: its slope does not lag.",
};
