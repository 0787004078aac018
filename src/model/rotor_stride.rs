//! How far apart the steps of a rotor's free run are.

use super::equations::Equations;
use super::runge_kutta::step_weights;
use crate::effect::step_response;

/// A step of integration covers at most this share of the fastest time constant.
const STEP_SHARE: f64 = 0.35;
/// [s] a state that reaches its steady state within a step this short needs no finer one.
const SHORTEST_STEP: f64 = 2.5e-3;

/// How a span of held inputs is gone through: what all spans of one length have in common.
#[derive(Clone, Copy)]
pub(super) struct Stride {
    /// [s] the span.
    pub(super) span: f64,
    /// Steps of it.
    pub(super) count: usize,
    /// [s] one of them.
    pub(super) step: f64,
    /// Weights of the ways to z, see [`step_weights`].
    pub(super) weights: [f64; 3],
    /// The step response of the lag after the whole span.
    pub(super) response: f64,
}

impl Equations {
    /// [1/s] the fastest rate that a step has to resolve.
    pub(super) fn fastest(&self) -> f64 {
        let hooks = self.steady.iter().chain(&self.rotor_sensor);
        let rates = hooks.filter_map(|hook| hook.memory().map(|memory| memory.rate()));
        // The laws on the acceleration move the pole by a small factor at most.
        let pole = if self.acceleration.is_empty() { 0.5 * self.pole } else { self.pole };
        rates.fold(pole, f64::max)
    }

    /// How a span is gone through.
    pub(super) fn stride(&self, span: f64, fastest: f64) -> Stride {
        // Rows that are one step apart, as most are, are not rounded up: an uneven clock asks for each of them.
        let steps = if span * fastest <= STEP_SHARE {
            1.0
        } else {
            let finest = (span / SHORTEST_STEP).max(span * self.pole).ceil().max(1.0);
            (span * fastest / STEP_SHARE).ceil().clamp(1.0, finest)
        };
        let step = span / steps;
        Stride {
            span,
            count: steps as usize,
            step,
            weights: step_weights(self.pole * step),
            response: step_response(self.pole, span),
        }
    }
}
