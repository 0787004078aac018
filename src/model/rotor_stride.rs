//! How far apart the steps of a rotor's free run are.

use super::equations::{Equations, Hook};
use super::rotor_state::RotorState;
use super::rotor_trace::MOST_STATES;
use super::runge_kutta::step_weights;
use super::thresholds::THRESHOLDS;
use crate::effect::{Point, SAME_SPAN, step_response};

/// How a span of held inputs is gone through: what all spans of one length have in common.
#[derive(Clone, Copy)]
pub(super) struct Stride {
    /// [s] the span.
    pub(super) span: f64,
    /// Steps of it.
    pub(super) count: usize,
    /// [s] one of them.
    pub(super) step: f64,
    /// Weights of the ways to z where no law acts on the acceleration, see [`step_weights`].
    pub(super) weights: [f64; 3],
    /// The step response of the lag after the whole span.
    pub(super) response: f64,
    /// Transitions of the laws with memory on the steady rate, over half a step.
    pub(super) half_steady: [f64; MOST_STATES],
    /// Transitions of those on the sensor, over a step.
    pub(super) sensor: [f64; MOST_STATES],
}

impl Stride {
    const NONE: Self = Self {
        span: f64::NAN,
        count: 0,
        step: 0.0,
        weights: [0.0; 3],
        response: 0.0,
        half_steady: [0.0; MOST_STATES],
        sensor: [0.0; MOST_STATES],
    };

    /// Whether it is long enough for a rotor to come to rest in it, so that asking for that pays.
    #[inline]
    pub(super) fn may_rest(&self) -> bool {
        self.count >= THRESHOLDS.steps_to_rest
    }

    /// Whether it is that of a span [s].
    fn is_of(&self, span: f64) -> bool {
        (self.span - span).abs() <= SAME_SPAN * span
    }
}

/// Where a state stops.
pub(super) struct Corner {
    /// Its place among the laws on the steady rate.
    at: usize,
    /// [s] from now.
    pub(super) after: f64,
    /// What it is there.
    value: f64,
}

/// Strides of the last two spans: rows of one interval share the exponentials and the steps, and a dead time cuts each row in two.
pub(super) struct Strides<'a> {
    equations: &'a Equations,
    fastest: f64,
    last: [Stride; 2],
    /// The one gone through last.
    at: usize,
}

impl<'a> Strides<'a> {
    pub(super) fn of(equations: &'a Equations) -> Self {
        let fastest = equations.fastest();
        Self { equations, fastest, last: [Stride::NONE; 2], at: 0 }
    }

    /// That of a span [s].
    #[inline]
    pub(super) fn over(&mut self, span: f64) -> &Stride {
        if !self.last[self.at].is_of(span) {
            self.at ^= 1;
            if !self.last[self.at].is_of(span) {
                self.equations.set_stride(&mut self.last[self.at], span, self.fastest);
            }
        }
        &self.last[self.at]
    }
}

impl Equations {
    /// Goes through a `span` [s] of held inputs, a step of it up to where a law stops at a corner; the integral of the rate over it,
    /// where that is wanted.
    #[inline]
    pub(super) fn go_through(
        &self,
        state: &mut RotorState,
        point: &mut Point,
        strides: &mut Strides,
        (span, wants_mean): (f64, bool),
    ) -> f64 {
        if self.is_lag() {
            let response = strides.over(span).response;
            let way = point.steady_rate - state.rate;
            state.rate += way * response;
            return point.steady_rate * span - way * response / self.pole;
        }
        let corner = if self.has_corner { self.corner(state, point) } else { None };
        let within = corner.filter(|corner| 0.0 < corner.after && corner.after < span);
        let Some(Corner { at, after, value }) = within else {
            return self.advance(state, point, strides.over(span), wants_mean);
        };
        if after < THRESHOLDS.corner_share * span {
            state.steady[at] = value;
            return self.advance(state, point, strides.over(span), wants_mean);
        }
        let held = point.steady_rate;
        let turned = self.advance(state, point, strides.over(after), wants_mean);
        point.steady_rate = held;
        turned + self.advance(state, point, strides.over(span - after), wants_mean)
    }

    /// Where a law on the steady rate stops at a corner, the point held.
    pub(super) fn corner(&self, state: &RotorState, point: &Point) -> Option<Corner> {
        let mut point = Point { propeller_rate: state.rate, ..*point };
        for (at, (hook, memory_state)) in self.steady.iter().zip(&state.steady).enumerate() {
            let Some(memory) = hook.memory() else {
                point.steady_rate += hook.add(&point);
                continue;
            };
            if let Some(after) = memory.corner(*memory_state, &point) {
                return Some(Corner { at, after, value: memory.steady_state(&point) });
            }
            point.steady_rate += memory.add(*memory_state, &point);
        }
        None
    }

    /// [1/s] the fastest rate that a step has to resolve.
    pub(super) fn fastest(&self) -> f64 {
        let hooks = self.steady.iter().chain(&self.rotor_sensor);
        let rates = hooks.filter_map(|hook| hook.memory().map(|memory| memory.rate()));
        // The laws on the acceleration move the pole by a small factor at most.
        let pole = if self.acceleration.is_empty() { 0.5 * self.pole } else { self.pole };
        // Behind a law of one's own that moves by itself a corner is not where it seems to be.
        let moves = |hook: &Hook| matches!(hook, Hook::Expression(..)) && hook.memory().is_some();
        let corner = self.has_corner && self.steady.iter().any(moves);
        rates.fold(if corner { pole.max(THRESHOLDS.moving_corner) } else { pole }, f64::max)
    }

    /// Makes a stride that of a span: an uneven clock asks for another one at each row, too many to be copied.
    fn set_stride(&self, stride: &mut Stride, span: f64, fastest: f64) {
        stride.span = span;
        if self.is_lag() {
            stride.response = step_response(self.pole, span);
            return;
        }
        // Rows that are one step apart, as most are, are not rounded up, nor divided.
        (stride.count, stride.step) = if span * fastest <= THRESHOLDS.step_share {
            (1, span)
        } else {
            let finest = (span / THRESHOLDS.shortest_step_s).max(span * self.pole).ceil().max(1.0);
            let steps = (span * fastest / THRESHOLDS.step_share).ceil().clamp(1.0, finest);
            (steps as usize, span / steps)
        };
        if self.acceleration.is_empty() {
            stride.weights = step_weights(self.pole * stride.step);
        }
        set_transitions(&self.steady, 0.5 * stride.step, &mut stride.half_steady);
        set_transitions(&self.rotor_sensor, stride.step, &mut stride.sensor);
    }

    /// Transitions over a step [s] of laws with memory on the rotor's sensor.
    pub(super) fn sensor_transitions(&self, step: f64) -> [f64; MOST_STATES] {
        let mut transitions = [0.0; MOST_STATES];
        set_transitions(&self.rotor_sensor, step, &mut transitions);
        transitions
    }
}

/// Transitions over a span [s] of laws with memory, each at its place.
#[inline]
fn set_transitions(hooks: &[Hook], span: f64, transitions: &mut [f64; MOST_STATES]) {
    for (transition, hook) in transitions.iter_mut().zip(hooks) {
        if let Some(memory) = hook.memory() {
            *transition = memory.transition(span);
        }
    }
}
