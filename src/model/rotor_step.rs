//! A rotor run freely step by step, beside a running bench: nothing is allocated, and a step's work is bounded.

use super::equations::Equations;
use super::rotor_state::RotorState;
use super::rotor_stride::Strides;
use super::rotor_trace::{MOST_STATES, RotorStart};
use crate::effect::Point;

/// [-] at which a standing rotor stands: there g(u) of a fit means nothing.
const STANDS: f64 = 0.0;

/// One rotor of a model, ready to be run beside a bench.
#[derive(Debug, Clone)]
pub struct Member {
    equations: Equations,
    /// Departure of slow states (heat) from the steady state of a standing rotor where it begins.
    slow: f64,
}

/// Where a [`Member`] is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MemberState {
    rotor: RotorState,
    command: [Option<f64>; MOST_STATES],
    /// [s] since it began.
    time: f64,
    /// [rad/s] what its sensor would read.
    reading: f64,
    has_begun: bool,
}

impl Member {
    /// A rotor with these equations; `slow` is how far slow states are from rest where it begins.
    #[must_use]
    pub fn new(equations: Equations, slow: f64) -> Self {
        Self { equations, slow }
    }

    /// [s] by which a command acts later than it is given.
    #[must_use]
    pub fn delay(&self) -> f64 {
        self.equations.command_delay
    }

    /// Whether a state of it forgets over many seconds where it began.
    #[must_use]
    pub fn is_slow(&self) -> bool {
        self.equations.steady.iter().any(|hook| hook.memory().is_some_and(|memory| memory.is_slow()))
    }

    /// Goes on by `span` [s] in which `command` is in force, the dead time taken off, and `voltage` holds; `side` says which rotor
    /// it is. Begins with a rotor that stands. A command of zero lets it run out as the model's pole has it.
    pub fn advance(&self, state: &mut MemberState, span: f64, command: f64, voltage: f64, side: f64) {
        let equations = &self.equations;
        let mut point = Point { side, time: state.time, ..equations.constants };
        let shaped = self.shaped(state, &mut point, command, voltage, span);
        point.steady_rate = if command <= STANDS {
            0.0
        } else {
            let curve = super::polynomial(&equations.steady_rate, shaped);
            (curve - equations.voltage_gain * (point.full_voltage - voltage)).max(0.0)
        };
        if !state.has_begun {
            let start = RotorStart { rate: Some(0.0), slow: self.slow, ..RotorStart::default() };
            state.rotor = equations.initial_state(point, &start);
            state.has_begun = true;
        }
        if span > 0.0 {
            equations.go_through(&mut state.rotor, &mut point, &mut Strides::of(equations), (span, false));
            // A standing motor is not driven backwards by a weak battery.
            state.rotor.rate = state.rotor.rate.max(0.0);
            state.time += span;
        }
        state.reading = equations.sensed(&state.rotor, &mut point);
    }

    /// [-] what laws on the command make of it.
    fn shaped(
        &self,
        state: &mut MemberState,
        point: &mut Point,
        command: f64,
        voltage: f64,
        span: f64,
    ) -> f64 {
        (point.command, point.battery_voltage) = (command, voltage);
        for (hook, kept) in self.equations.command.iter().zip(&mut state.command) {
            point.command += match hook.memory() {
                Some(memory) => {
                    let now = kept
                        .map_or_else(|| memory.steady_state(point), |kept| memory.advance(kept, point, span));
                    *kept = Some(now);
                    memory.add(now, point)
                }
                None => hook.add(point),
            };
        }
        point.command
    }
}

impl MemberState {
    /// [rad/s] what the rotor's sensor would read now.
    #[must_use]
    pub fn reading(&self) -> f64 {
        self.reading
    }
}
