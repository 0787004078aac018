//! The motor weakens as it warms up.

use super::{Card, Law, Memory, Parameter, Point, Site, Symmetry, response_after};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "motor_heating",
    meaning: "The motor weakens as it warms up.",
    equation: "z (1 - k h), τ h' = (ω_p/ω_0)³ - h",
    source: "first-order warming by the power of the propeller, which grows with the cube of its speed",
    site: Site::SteadyRate,
    parameters: &[
        Parameter {
            name: "gain",
            symbol: "k",
            unit: "-",
            // Heat never makes a motor faster: what would need that is a drift of another cause.
            lower: 0.0,
            upper: 0.8,
            start: 0.03,
            others: &[],
            neutral: 0.0,
            meaning: "share of the rate lost when warm at hover",
        },
        Parameter {
            name: "time_constant",
            symbol: "τ",
            unit: "s",
            lower: 0.5,
            upper: 2e3,
            start: 20.0,
            others: &[5.0, 80.0],
            neutral: f64::NAN,
            meaning: "how slowly it warms",
        },
    ],
    law: Law::Memory(Memory { steady_state, transition, advance, add, rate, corner: None, slow: true }),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: None,
    report: [
        "After hard work the same command turns the rotor more slowly, and it recovers with rest.",
        "Winding and magnets lose strength as they warm.",
    ],
    residual: "A slow error that follows the power of the last seconds, not the battery.",
    confused_with: &["battery_sag", "battery_scaling"],
    experiment: "Long constant commands high, low, high: heat recovers at the low one, the battery does not.",
};

/// The heat at which warming and cooling balance.
fn steady_state(_: &[f64], point: &Point) -> f64 {
    (point.propeller_rate / point.hover_rate).powi(3)
}

fn transition(parameters: &[f64], span: f64) -> f64 {
    parameters.get(1).map_or(0.0, |time_constant| response_after(span / time_constant))
}

fn advance(parameters: &[f64], state: f64, point: &Point, share: f64) -> f64 {
    state + (steady_state(parameters, point) - state) * share
}

fn add(parameters: &[f64], state: f64, point: &Point) -> f64 {
    let [gain, _] = *parameters else { return 0.0 };
    -gain * state * point.steady_rate
}

fn rate(parameters: &[f64]) -> f64 {
    parameters.get(1).map_or(0.0, |time_constant| 1.0 / time_constant)
}
