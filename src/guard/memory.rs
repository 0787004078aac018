//! What the guard remembers from step to step.

use super::events::EventRing;
use super::gate::CommandGate;
use super::output::Output;
use super::signals::SignalTrack;
use super::speed_track::SpeedTrack;
use super::table::{Cause, State};
use crate::signal::{Channel, GuardEvent};

/// Subject of an event that speaks of no signal.
pub(super) const NO_SUBJECT: u32 = u32::MAX;

/// What the guard remembers.
#[derive(Debug, Clone, PartialEq)]
pub struct GuardState {
    pub(super) state: State,
    pub(super) cause: Cause,
    /// [ns] when the state was entered.
    pub(super) entered_ns: u64,
    /// [ns] when a latch was entered last; 0 = never.
    pub(super) latched_ns: u64,
    /// [ns] first step since the start; 0 = none yet.
    pub(super) born_ns: u64,
    /// [ns] last step.
    pub(super) stepped_ns: u64,
    /// [ns] when something was last found wanting.
    pub(super) wanting_ns: u64,
    /// [periods] leaky bucket of misses.
    pub(super) bucket: f64,
    pub(super) gate: CommandGate,
    pub(super) signals: [SignalTrack; Channel::WATCHED.len()],
    pub(super) speed: Box<SpeedTrack>,
    pub(super) output: Output,
    /// Sequence and stamp of the last request looked at.
    pub(super) request: (u64, u64),
    pub(super) events: EventRing,
    pub(super) refusals: [u64; Cause::COUNT],
}

impl Default for GuardState {
    fn default() -> Self {
        Self::new()
    }
}

impl GuardState {
    /// Disarmed, knowing nothing.
    #[must_use]
    pub fn new() -> Self {
        Self {
            state: State::Disarmed,
            cause: Cause::None,
            entered_ns: 0,
            latched_ns: 0,
            born_ns: 0,
            stepped_ns: 0,
            wanting_ns: 0,
            bucket: 0.0,
            gate: CommandGate::default(),
            signals: [SignalTrack::default(); Channel::WATCHED.len()],
            speed: Box::default(),
            output: Output::default(),
            request: (0, 0),
            events: EventRing::new(),
            refusals: [0; Cause::COUNT],
        }
    }

    /// The state now.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// Cause of the last transition.
    #[must_use]
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// Takes the events since the last call, oldest first.
    pub fn take_events(&mut self) -> impl Iterator<Item = GuardEvent> + '_ {
        std::iter::from_fn(|| self.events.pop())
    }

    /// Events that did not fit between two calls of [`Self::take_events`].
    #[must_use]
    pub fn dropped_events(&self) -> u64 {
        self.events.dropped()
    }

    /// How many commands and requests were refused for `cause`.
    #[must_use]
    pub fn refusals(&self, cause: Cause) -> u64 {
        self.refusals.get(cause as usize).copied().unwrap_or(0)
    }
}
