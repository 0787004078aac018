//! The gyroscope is filtered.

use super::{Card, Law, Memory, Parameter, Point, Site, Symmetry, followed};

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
    law: Law::Memory(Memory { settle, advance, add, rate, slow: false }),
    needs: &["body_rate_rad_s"],
    symmetry: Symmetry::None,
    report: [
        "The gyroscope follows the true rate with a lag.",
        "The low-pass in the sensor is slower than the model assumes.",
    ],
    residual: "An error in proportion to the body's acceleration.",
    confused_with: &["rotor_lag", "torque_delay"],
    experiment: "An encoder beside the gyroscope: its slope does not lag.",
};

fn settle(_: &[f64], point: &Point) -> f64 {
    point.body_rate
}

fn advance(parameters: &[f64], state: f64, point: &Point, span: f64) -> f64 {
    let [pole] = *parameters else { return point.body_rate };
    state + (point.body_rate - state) * followed(pole, span)
}

fn add(_: &[f64], state: f64, point: &Point) -> f64 {
    state - point.body_rate
}

fn rate(parameters: &[f64]) -> f64 {
    parameters.first().copied().filter(|pole| pole.is_finite()).unwrap_or(0.0)
}
