//! What is found wanting in a step: of the command, of the signals, of the guard's own time. The worst of it decides.

use super::built::Guard;
use super::memory::{GuardState, NO_SUBJECT};
use super::signals::SignalState;
use super::table::Cause;

use crate::signal::{Channel, Sensor, Sensors};

/// Something found wanting in this step, worst first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Trouble {
    pub(super) cause: Cause,
    pub(super) subject: u32,
    pub(super) value: f64,
    /// There is no point in holding any longer.
    pub(super) trips: bool,
}

impl Guard {
    /// Periods by which a fresh command is overdue.
    pub(super) fn misses(&self, state: &GuardState, now_ns: u64) -> u32 {
        let late_ns = now_ns.saturating_sub(state.gate.passed_ns).saturating_sub(self.lateness_ns);
        if late_ns < self.period_ns {
            // As a rule; a division is as long as half of all else.
            return 0;
        }
        u32::try_from(late_ns / self.period_ns).unwrap_or(u32::MAX)
    }

    /// The worst thing about this step: what trips comes before what only degrades.
    pub(super) fn worst(
        &self,
        state: &mut GuardState,
        now_ns: u64,
        step_ns: u64,
        sensors: &Sensors,
        misses: u32,
    ) -> Option<Trouble> {
        let active = state.state.is_active();
        let mut worst = self.command_trouble(state, now_ns, misses);
        if active && step_ns > self.hold_ns {
            let value = step_ns as f64 * 1e-9;
            worst = Some(Trouble { cause: Cause::GuardPaused, subject: NO_SUBJECT, value, trips: true });
        }
        if active && state.output.swings() >= self.swing_limit {
            let value = state.output.swings();
            worst = Some(Trouble { cause: Cause::Oscillation, subject: NO_SUBJECT, value, trips: true });
        }
        if let Some(trouble) = self.speed_trouble(state, now_ns, sensors)
            && worst.is_none_or(|worst| !worst.trips)
        {
            worst = Some(trouble);
        }
        let turning = active && state.output.turns();
        for ((limit, track), channel) in self.signals.iter().zip(&mut state.signals).zip(Channel::WATCHED) {
            if !limit.required {
                continue;
            }
            let sample = channel.of(sensors);
            let (cause, trips) = match track.assess(limit, sample, now_ns, turning) {
                SignalState::Good => continue,
                SignalState::Bad(cause) => (cause, false),
                SignalState::Lost(cause) => (cause, true),
            };
            if worst.is_none_or(|worst| trips && !worst.trips) {
                worst = Some(Trouble { cause, subject: channel.subject(), value: sample.value, trips });
            }
        }
        worst
    }

    /// A rotor whose speed does not answer what left the guard.
    fn speed_trouble(&self, state: &mut GuardState, now_ns: u64, sensors: &Sensors) -> Option<Trouble> {
        let model = self.speed.as_ref()?;
        let (rotor, cause, value) = state.speed.assess(model, now_ns, state.output.rotor(), sensors)?;
        let channel =
            Channel::WATCHED.into_iter().filter(|it| it.sensor() == Sensor::PropellerRate).nth(rotor);
        Some(Trouble { cause, subject: channel.map_or(NO_SUBJECT, Channel::subject), value, trips: true })
    }

    fn command_trouble(&self, state: &GuardState, now_ns: u64, misses: u32) -> Option<Trouble> {
        let gate = &state.gate;
        // From the command before the one that first left newer sensors unanswered, as misses are counted. A controller
        // that is given no new sensors is not deaf.
        let unanswered_ns = gate.unanswered_ns(now_ns).saturating_add(self.period_ns);
        let age_ns = now_ns.saturating_sub(gate.stamp_ns);
        let (cause, trips) = if misses >= self.hold_periods || gate.passed_ns == 0 {
            // Also when a fresh one is here now: the rotors were without for too long.
            (gate.complaint.unwrap_or(Cause::CommandMissing), true)
        } else if age_ns > self.time_to_live_ns {
            (Cause::CommandExpired, true)
        } else if unanswered_ns > self.hold_ns.saturating_add(self.lateness_ns) {
            (Cause::CommandAnswersOldSensors, true)
        } else if misses >= 1 {
            (gate.complaint.unwrap_or(Cause::CommandMissing), false)
        } else if unanswered_ns > self.unanswered_ns {
            (Cause::CommandAnswersOldSensors, false)
        } else {
            return None;
        };
        Some(Trouble { cause, subject: NO_SUBJECT, value: f64::from(misses), trips })
    }

    /// Misses that are never N in a row fill a leaky bucket.
    pub(super) fn fill_bucket(
        &self,
        state: &mut GuardState,
        step_ns: u64,
        trouble: Option<Trouble>,
    ) -> Option<Trouble> {
        if !state.state.is_active() {
            state.bucket = 0.0;
            return trouble;
        }
        let periods = step_ns as f64 / self.period_ns as f64;
        let change = if trouble.is_some() { periods } else { -self.bucket_leak * periods };
        state.bucket = (state.bucket + change).max(0.0);
        if state.bucket < self.bucket_limit || trouble.is_some_and(|trouble| trouble.trips) {
            return trouble;
        }
        Some(Trouble { cause: Cause::TooManyMisses, subject: NO_SUBJECT, value: state.bucket, trips: true })
    }
}
