//! The last gate in front of any actuator, real or emulated.
//!
//! A written table ([`TRANSITIONS`]) says which state follows which; [`Guard::step`] is its only driver. The
//! ladder under a fault is: hold the last command for N periods, ramp to zero, latch. What feeds it is
//! freshness: a command must be new, young, stamped later than the one before, and answer new sensor values.
//!
//! `step` may be called as often as one likes, at least once a period: all its times are read from the stamps
//! it is given, none from the number of calls.

mod built;
mod config;
mod events;
mod gate;
mod memory;
mod output;
mod signals;
mod speed_config;
mod speed_model;
mod speed_track;
mod table;
pub mod thresholds;
mod trouble;

pub use built::{Guard, Limits};
pub use config::{GuardConfig, GuardError, SignalLimitsConfig};
pub use memory::GuardState;
pub use speed_config::SpeedCheckConfig;
pub use speed_model::{Lacks, SpeedCheck, SpeedCheckError};
pub use table::{Cause, OperatorAct, State, TRANSITIONS, Trigger};

use gate::{GateRules, Passage};
use memory::NO_SUBJECT;
use trouble::Trouble;

use crate::signal::{Applied, Channel, Command, GuardEvent, Request, Sensors};

impl Guard {
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
