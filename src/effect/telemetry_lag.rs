//! The speed controller filters the rotor rate that it reports.

use super::{Card, Law, Memory, Parameter, Point, Site, Symmetry, followed};

/// The card.
pub(super) static CARD: Card = Card {
    id: "telemetry_lag",
    meaning: "The speed controller filters the rotor rate that it reports.",
    equation: "y' = p_t (ω_p - y)",
    source: "first-order filter in the telemetry of the speed controller",
    site: Site::RotorRateSensor,
    parameters: &[Parameter {
        name: "pole",
        symbol: "p_t",
        unit: "rad/s",
        lower: 1.0,
        upper: 2e3,
        start: 60.0,
        others: &[20.0, 200.0],
        neutral: f64::INFINITY,
        meaning: "pole of the filter",
    }],
    law: Law::Memory(Memory { settle, advance, add, rate, slow: false }),
    needs: &["command_*", "propeller_rate_*_rad_s"],
    symmetry: Symmetry::None,
    report: [
        "The reported rotor rate lags behind the true one.",
        "The rotor itself is as fast as the model says.",
    ],
    residual: "As a second lag of the rotor, seen from the telemetry; the body, driven by the true rotor, seems to run ahead.",
    confused_with: &["second_order_lag", "transport_delay"],
    experiment: "A body rate or a load cell beside the telemetry: they see the true rotor.",
};

fn settle(_: &[f64], point: &Point) -> f64 {
    point.propeller_rate
}

fn advance(parameters: &[f64], state: f64, point: &Point, span: f64) -> f64 {
    let [pole] = *parameters else { return point.propeller_rate };
    state + (point.propeller_rate - state) * followed(pole, span)
}

fn add(_: &[f64], state: f64, point: &Point) -> f64 {
    state - point.propeller_rate
}

fn rate(parameters: &[f64]) -> f64 {
    parameters.first().copied().filter(|pole| pole.is_finite()).unwrap_or(0.0)
}
