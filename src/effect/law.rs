//! How effects act.

use super::{Expression, Point};

/// A law without memory: parameters and point in, what it adds to its site out.
pub type StaticLaw = fn(&[f64], &Point) -> f64;

/// What a law with memory says of its state: parameters, state and point in.
pub type StateLaw = fn(&[f64], f64, &Point) -> f64;

/// The law of a constant: what it adds is its one parameter.
pub(super) fn constant(parameters: &[f64], _: &Point) -> f64 {
    parameters.first().copied().unwrap_or(0.0)
}

/// A law with one state of its own.
#[derive(Debug, Clone, Copy)]
pub struct Memory {
    /// The steady state at a point.
    pub steady_state: fn(&[f64], &Point) -> f64,
    /// What a span [s] makes of it, whatever the point: of a lag the share of the way that it goes, of a ramp the most that it does.
    pub transition: fn(&[f64], f64) -> f64,
    /// The state after a span with this transition, the point held.
    pub advance: fn(&[f64], f64, &Point, f64) -> f64,
    /// What it adds to its site.
    pub add: StateLaw,
    /// [1/s] the fastest rate a simulation has to resolve.
    pub rate: fn(&[f64]) -> f64,
    /// Of a state that stops at a corner: [s] until it is there, the point held. A step ends there, and none needs to resolve it while what
    /// it goes to is held, or slow.
    pub corner: Option<StateLaw>,
    /// Whether the state at a log's start is unknown and matters, so that a fit must find it.
    pub slow: bool,
}

/// How an effect acts.
#[derive(Debug, Clone)]
pub enum Law {
    /// Holds the quantity of its site back by the time [s] it answers.
    Delay(fn(&[f64]) -> f64),
    /// Without memory.
    Static(StaticLaw),
    /// Without memory, and one that makes the equations stiff: it turns round within a few milliseconds, as friction does where a
    /// body comes to rest.
    Stiff(StaticLaw),
    /// Without memory, and piecewise constant in its one parameter: no slope leads a fit, which must look at every value.
    PiecewiseConstant(StaticLaw),
    /// With one state.
    Memory(Memory),
    /// A user's expression, without memory.
    Expression(std::sync::Arc<Expression>),
}
