//! What leaves: absolute limit, spin-up, slew, ramp to zero. Nothing else writes to a rotor.

use super::built::Guard;
use super::gate::CommandGate;
use super::table::State;
use super::thresholds::THRESHOLDS;
use crate::signal::{Applied, AppliedFlags, ROTORS};

/// What left in the last step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Output {
    rotor: [f64; ROTORS],
    sequence: u64,
    /// [ns] when the bench was armed: the spin-up's beginning.
    armed_ns: u64,
    /// [ns] when the ramp began, and from where; down at zero it stays there.
    ramp_ns: u64,
    ramp_from: [f64; ROTORS],
    /// Sequence and stamp [ns] of the command that the rotors got last. Not the gate's: commands go on
    /// passing the gate in a latch, and must not make a ramp young again.
    source: (u64, u64),
    sides: [Side; ROTORS],
    swings: [f64; ROTORS],
}

/// The limit that a rotor's command last stood at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum Side {
    #[default]
    Neither,
    Low,
    High,
}

impl Output {
    /// [-] what the rotors got last.
    pub(super) fn rotor(&self) -> [f64; ROTORS] {
        self.rotor
    }

    /// Whether a rotor is commanded at all.
    pub(super) fn turns(&self) -> bool {
        self.rotor.iter().any(|command| *command > 0.0)
    }

    /// Swings from limit to limit, of the rotor that has more.
    pub(super) fn swings(&self) -> f64 {
        self.swings.iter().fold(0.0, |most, swings| most.max(*swings))
    }

    /// A transition: arming begins the spin-up, the failsafe begins the ramp, everything else means zero.
    pub(super) fn enter(&mut self, from: State, to: State, now_ns: u64) {
        match to {
            State::Armed | State::Degraded if from.is_active() => {}
            State::FailsafeLatched => (self.ramp_ns, self.ramp_from) = (now_ns, self.rotor),
            _ => {
                self.armed_ns = now_ns;
                self.sides = [Side::Neither; ROTORS];
                self.swings = [0.0; ROTORS];
            }
        }
    }

    /// What the rotors get in this step.
    pub(super) fn emit(
        &mut self,
        guard: &Guard,
        gate: &CommandGate,
        state: State,
        now_ns: u64,
        step_ns: u64,
    ) -> Applied {
        self.sequence += 1;
        let flags = match state {
            State::Armed | State::Degraded => self.follow(guard, gate, now_ns, step_ns),
            State::FailsafeLatched => self.ramp(guard, now_ns),
            State::Disarmed | State::PreArm | State::EmergencyStop => {
                self.rotor = [0.0; ROTORS];
                0
            }
        };
        let follows = state.is_active() || flags != 0;
        Applied {
            sequence: self.sequence,
            stamp_ns: now_ns,
            command_sequence: if follows { self.source.0 } else { 0 },
            rotor: self.rotor,
            flags,
            ..Applied::default()
        }
    }

    /// The gate's command, within the limits.
    fn follow(&mut self, guard: &Guard, gate: &CommandGate, now_ns: u64, step_ns: u64) -> u32 {
        self.source = (gate.sequence, gate.stamp_ns);
        let maximum = guard.limits.maximum;
        let spun_up_ns = now_ns.saturating_sub(self.armed_ns);
        let spin_up =
            if spun_up_ns < guard.spin_up_ns { spun_up_ns as f64 / guard.spin_up_ns as f64 } else { 1.0 };
        // After a pause of the guard itself, one period's slew and no more.
        let change = guard.limits.slew_per_s * step_ns.min(guard.period_ns) as f64 * 1e-9;
        let leak = guard.swing_limit / THRESHOLDS.swing_leak_s * step_ns as f64 * 1e-9;
        let held = now_ns.saturating_sub(gate.passed_ns) >= guard.held_ns;
        let mut flags = if held { AppliedFlags::HELD } else { 0 };
        let memory = self.sides.iter_mut().zip(&mut self.swings);
        for ((rotor, wanted), (side, swings)) in self.rotor.iter_mut().zip(gate.rotor).zip(memory) {
            let limited = wanted.clamp(0.0, maximum * spin_up);
            let slewed = limited.clamp(*rotor - change, *rotor + change);
            flags |= if limited != wanted { AppliedFlags::LIMITED } else { 0 };
            flags |= if slewed != limited { AppliedFlags::SLEWED } else { 0 };
            let now = if wanted >= maximum || slewed < limited {
                Side::High
            } else if wanted <= 0.0 || slewed > limited {
                Side::Low
            } else {
                *side
            };
            let swung = *side != Side::Neither && now != *side;
            *swings = (*swings - leak).max(0.0) + if swung { 1.0 } else { 0.0 };
            *side = now;
            *rotor = slewed;
        }
        flags
    }

    /// Down in equal steps; at once when the command it came from is too old even for that.
    fn ramp(&mut self, guard: &Guard, now_ns: u64) -> u32 {
        let ramp_ns = guard.period_ns.saturating_mul(u64::from(guard.ramp_periods));
        // A little early is not early: the ramp's last step must not slip by a period.
        let since_ns = now_ns.saturating_sub(self.ramp_ns).saturating_add(guard.lateness_ns);
        let steps = since_ns / guard.period_ns + 1;
        let age_ns = now_ns.saturating_sub(self.source.1);
        let expired = age_ns > guard.time_to_live_ns.saturating_add(ramp_ns);
        if steps >= u64::from(guard.ramp_periods) || expired {
            self.rotor = [0.0; ROTORS];
            self.ramp_from = self.rotor;
            return 0;
        }
        let share = 1.0 - steps as f64 / f64::from(guard.ramp_periods);
        for (rotor, from) in self.rotor.iter_mut().zip(self.ramp_from) {
            *rotor = from * share;
        }
        AppliedFlags::RAMPING
    }
}
