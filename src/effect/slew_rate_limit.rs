//! The speed controller ramps its target instead of stepping it.

use super::{Card, Law, Memory, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "slew_rate_limit",
    meaning: "The speed controller ramps its target instead of stepping it.",
    equation: "abs(dz/dt) ≤ r",
    source: "acceleration limit set in the speed controller",
    site: Site::SteadyRate,
    parameters: &[Parameter {
        name: "rate",
        symbol: "r",
        unit: "rad/s^2",
        lower: 10.0,
        upper: 1e5,
        start: 3e3,
        others: &[500.0, 1.5e3, 8e3],
        neutral: f64::INFINITY,
        meaning: "fastest change of the steady rate",
    }],
    law: Law::Memory(Memory {
        steady_state,
        transition,
        advance,
        add,
        rate,
        corner: Some(corner),
        slow: false,
    }),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: true,
    acts_as: Some(Term::SlewLimit),
    report: [
        "Large steps are answered by a ramp, small ones as the model says.",
        "The speed controller limits how fast its target may change.",
    ],
    residual: "Errors after large steps that last longer the larger the step; none after small ones.",
    confused_with: &["second_order_lag", "transport_delay"],
    experiment: "Steps of very different size: a limit slows only the large ones.",
};

fn steady_state(_: &[f64], point: &Point) -> f64 {
    point.steady_rate
}

fn transition(parameters: &[f64], span: f64) -> f64 {
    parameters.first().map_or(f64::INFINITY, |rate| (rate * span).abs())
}

fn advance(_: &[f64], state: f64, point: &Point, most: f64) -> f64 {
    state + (point.steady_rate - state).clamp(-most, most)
}

fn add(_: &[f64], state: f64, point: &Point) -> f64 {
    state - point.steady_rate
}

/// A ramp is a straight line up to its corner, at which a step ends.
fn rate(_: &[f64]) -> f64 {
    0.0
}

fn corner(parameters: &[f64], state: f64, point: &Point) -> f64 {
    parameters.first().map_or(0.0, |rate| ((point.steady_rate - state) / rate).abs())
}
