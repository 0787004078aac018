//! The last gate in front of any actuator, real or emulated.
//!
//! A written table ([`TRANSITIONS`]) says which state follows which; [`Guard::step`] is its only driver. The
//! ladder under a fault is: hold the last command for N periods, ramp to zero, latch. What feeds it is
//! freshness: a command must be new, young, stamped later than the one before, and answer new sensor values.
//!
//! `step` may be called as often as one likes, at least once a period: all its times are read from the stamps
//! it is given, none from the number of calls.

mod config;
mod events;
mod gate;
mod output;
mod signals;
mod table;
pub mod thresholds;
mod trouble;

pub use config::{GuardConfig, GuardError, SignalConfig};
pub use table::{Cause, OperatorAct, State, TRANSITIONS, Trigger};

use events::EventRing;
use gate::{CommandGate, GateRules, Passage};
use output::Output;
use signals::{SignalLimit, SignalTrack};
use trouble::Trouble;

use crate::signal::{Applied, Channel, Command, GuardEvent, Request, Sensors};

/// Subject of an event that speaks of no signal.
const NO_SUBJECT: u32 = u32::MAX;

/// What an experiment must fit into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// [-] highest command that leaves.
    pub maximum: f64,
    /// [1/s] fastest change of a command.
    pub slew_per_s: f64,
}

/// A built guard.
#[derive(Debug, Clone, PartialEq)]
pub struct Guard {
    limits: Limits,
    period_ns: u64,
    hold_ns: u64,
    hold_periods: u32,
    ramp_periods: u32,
    time_to_live_ns: u64,
    spin_up_ns: u64,
    bucket_limit: f64,
    bucket_leak: f64,
    swing_limit: f64,
    arm_checks_ns: u64,
    arm_timeout_ns: u64,
    request_time_to_live_ns: u64,
    signals: [SignalLimit; Channel::WATCHED.len()],
}

/// What the guard remembers.
#[derive(Debug, Clone, PartialEq)]
pub struct GuardState {
    state: State,
    cause: Cause,
    /// [ns] when the state was entered.
    entered_ns: u64,
    /// [ns] when a latch was entered last; 0 = never.
    latched_ns: u64,
    /// [ns] first step since the start; 0 = none yet.
    born_ns: u64,
    /// [ns] last step.
    stepped_ns: u64,
    /// [ns] when something was last found wanting.
    wanting_ns: u64,
    /// [periods] leaky bucket of misses.
    bucket: f64,
    gate: CommandGate,
    signals: [SignalTrack; Channel::WATCHED.len()],
    output: Output,
    /// Sequence and stamp of the last request looked at.
    request: (u64, u64),
    events: EventRing,
    refusals: [u64; Cause::COUNT],
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

impl Guard {
    /// What an experiment must fit into.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Signals without which the bench is neither armed nor kept running, each with the age [ns] at which it is
    /// stale.
    pub fn requirements(&self) -> impl Iterator<Item = (Channel, u64)> + '_ {
        let signals = Channel::WATCHED.into_iter().zip(&self.signals);
        signals.filter(|(_, limit)| limit.required).map(|(channel, limit)| (channel, limit.stale_after_ns))
    }

    /// N: periods that a command is held.
    #[must_use]
    pub fn hold_periods(&self) -> u32 {
        self.hold_periods
    }

    /// Periods from the end of the hold to zero.
    #[must_use]
    pub fn ramp_periods(&self) -> u32 {
        self.ramp_periods
    }

    /// [ns] age at which a command may no longer leave.
    #[must_use]
    pub fn time_to_live_ns(&self) -> u64 {
        self.time_to_live_ns
    }

    /// One step at `now_ns` (CLOCK_MONOTONIC, or virtual time in lockstep): judges the newest sensors, command
    /// and request, and says what the rotors get. Neither fails nor allocates nor reads a clock.
    pub fn step(
        &self,
        state: &mut GuardState,
        now_ns: u64,
        sensors: &Sensors,
        newest: Option<&Command>,
        request: Option<&Request>,
    ) -> Applied {
        if state.born_ns == 0 {
            (state.born_ns, state.stepped_ns) = (now_ns, now_ns);
        }
        let step_ns = now_ns.saturating_sub(state.stepped_ns);
        state.stepped_ns = now_ns;
        if let Some(request) = request {
            self.obey(state, now_ns, request);
        }
        let misses = self.misses(state, now_ns);
        let fresh = self.take_command(state, now_ns, sensors, newest);
        let trouble = self.worst(state, now_ns, step_ns, sensors, misses);
        let trouble = self.fill_bucket(state, step_ns, trouble);
        self.advance(state, now_ns, trouble);
        let misses = if fresh { 0 } else { misses };
        let applied = state.output.emit(self, &state.gate, state.state, now_ns, step_ns);
        Applied { state: state.state as u32, cause: state.cause as u32, misses, ..applied }
    }

    /// Adds to `sensors` what time and this guard's limits say of them: [`Health::STALE`], [`Health::FROZEN`]. For
    /// whoever reads them; the guard itself judges by the stamps.
    pub fn mark(&self, state: &GuardState, now_ns: u64, sensors: &mut Sensors) {
        for ((limit, track), channel) in self.signals.iter().zip(&state.signals).zip(Channel::WATCHED) {
            let sample = channel.of_mut(sensors);
            sample.health |= track.flags(limit, sample, now_ns);
        }
    }

    /// Latches from outside the step: the bus died or has another master, the process is ending. The next step begins
    /// the ramp.
    pub fn trip(&self, state: &mut GuardState, now_ns: u64, cause: Cause) {
        self.fire(state, now_ns, Trigger::Trip, cause, NO_SUBJECT, 0.0);
    }

    fn take_command(
        &self,
        state: &mut GuardState,
        now_ns: u64,
        sensors: &Sensors,
        newest: Option<&Command>,
    ) -> bool {
        let rules = GateRules {
            period_ns: self.period_ns,
            time_to_live_ns: self.time_to_live_ns,
            may_restart: !state.state.is_active(),
        };
        let before = state.gate.complaint;
        match state.gate.examine(&rules, now_ns, sensors.sequence, newest) {
            Passage::Nothing => false,
            Passage::Fresh => true,
            Passage::Refused(cause, value) => {
                // Each refusal is counted; only the first of a kind is an event.
                self.refuse(state, now_ns, cause, value, before != Some(cause));
                false
            }
        }
    }

    fn refuse(&self, state: &mut GuardState, now_ns: u64, cause: Cause, value: f64, is_event: bool) {
        if let Some(count) = state.refusals.get_mut(cause as usize) {
            *count += 1;
        }
        if is_event {
            let (from, to, cause) = (state.state as u32, state.state as u32, cause as u32);
            let subject = NO_SUBJECT;
            state.events.push(GuardEvent { sequence: 0, stamp_ns: now_ns, from, to, cause, subject, value });
        }
    }

    fn obey(&self, state: &mut GuardState, now_ns: u64, request: &Request) {
        let identity = (request.sequence, request.stamp_ns);
        if identity == state.request {
            return;
        }
        state.request = identity;
        let Some(act) = OperatorAct::from_code(request.act) else {
            return self.refuse(state, now_ns, Cause::RequestUnknown, f64::from(request.act), true);
        };
        // A request left over from another run of the guard must not arm this one. A stop is obeyed however old.
        let age_ns = now_ns.abs_diff(request.stamp_ns);
        // Nor may a word from before a latch undo the latch when it arrives after it, or arm what was disarmed since.
        let overtaken = request.stamp_ns < state.latched_ns;
        let stale = (age_ns > self.request_time_to_live_ns || overtaken) && act != OperatorAct::Stop;
        if stale || request.stamp_ns < state.born_ns {
            return self.refuse(state, now_ns, Cause::RequestStale, age_ns as f64 * 1e-9, true);
        }
        let (trigger, cause) = act.meaning();
        if state.state.next(trigger).is_none() {
            return self.refuse(state, now_ns, Cause::RequestRefused, f64::from(request.act), true);
        }
        self.fire(state, now_ns, trigger, cause, NO_SUBJECT, 0.0);
    }

    /// Drives the table.
    fn advance(&self, state: &mut GuardState, now_ns: u64, trouble: Option<Trouble>) {
        if trouble.is_some() {
            state.wanting_ns = now_ns;
        }
        let clean_ns = now_ns.saturating_sub(state.wanting_ns.max(state.entered_ns));
        let in_state_ns = now_ns.saturating_sub(state.entered_ns);
        match (state.state, trouble) {
            (State::PreArm, None) if clean_ns >= self.arm_checks_ns => {
                self.fire(state, now_ns, Trigger::ChecksPassed, Cause::ChecksPassed, NO_SUBJECT, 0.0);
            }
            (State::PreArm, Some(why)) if in_state_ns >= self.arm_timeout_ns => {
                self.fire(state, now_ns, Trigger::ChecksFailed, why.cause, why.subject, why.value);
            }
            (State::Armed | State::Degraded, Some(why)) if why.trips => {
                self.fire(state, now_ns, Trigger::Trip, why.cause, why.subject, why.value);
            }
            (State::Armed, Some(why)) => {
                self.fire(state, now_ns, Trigger::Miss, why.cause, why.subject, why.value);
            }
            (State::Degraded, None) if clean_ns >= self.hold_ns => {
                self.fire(state, now_ns, Trigger::Recover, Cause::Recovered, NO_SUBJECT, 0.0);
            }
            _ => {}
        }
    }

    /// Makes a transition if the table has it, and records the event.
    fn fire(
        &self,
        state: &mut GuardState,
        now_ns: u64,
        trigger: Trigger,
        cause: Cause,
        subject: u32,
        value: f64,
    ) {
        let Some(to) = state.state.next(trigger) else { return };
        let from = std::mem::replace(&mut state.state, to);
        state.cause = cause;
        state.entered_ns = now_ns;
        if matches!(to, State::FailsafeLatched | State::EmergencyStop) {
            state.latched_ns = now_ns;
        }
        state.output.enter(from, to, now_ns);
        let (from, to, cause) = (from as u32, to as u32, cause as u32);
        state.events.push(GuardEvent { sequence: 0, stamp_ns: now_ns, from, to, cause, subject, value });
    }
}
