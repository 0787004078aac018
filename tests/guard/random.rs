//! A million random steps.

use std::collections::BTreeSet;

use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::signal::{AppliedFlags, Command};

use crate::rig::{Rig, T, defaults};

/// A small generator, repeatable from its seed on every machine.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) % sides
    }

    fn unit(&mut self) -> f64 {
        self.roll(1 << 40) as f64 / (1_u64 << 40) as f64
    }
}

/// Random commands, mostly good; remembers the stamp of each that could be let through.
fn random_command(rig: &mut Rig, dice: &mut Dice) {
    let before = rig.command;
    rig.answer();
    rig.command.rotor = [dice.unit() * 1.2 - 0.1, dice.unit()];
    match dice.roll(24) {
        0 => rig.command.rotor[0] = f64::NAN,
        1 => rig.command.rotor[1] = f64::NEG_INFINITY,
        2 => rig.command.stamp_ns += dice.roll(3 * T),
        3 => rig.command.stamp_ns -= dice.roll(10 * T),
        4 => rig.command.sequence = dice.roll(rig.command.sequence + 1),
        5 => rig.command.sensors_sequence = dice.roll(rig.command.sensors_sequence + 3),
        6 | 7 => rig.command = before,
        8 => rig.command.rotor = [1e300, -1e300],
        9 => rig.command = Command { stamp_ns: rig.now, ..before },
        _ => {}
    }
}

fn random_sensors(rig: &mut Rig, dice: &mut Dice) {
    let before = rig.sensors;
    rig.sense();
    let sample = match dice.roll(4) {
        0 => &mut rig.sensors.body_rate,
        1 => &mut rig.sensors.battery_voltage,
        2 => &mut rig.sensors.propeller_rate[0],
        _ => &mut rig.sensors.body_angle,
    };
    match dice.roll(40) {
        0 => sample.value = f64::NAN,
        1 => sample.value = 1e9,
        2 => sample.health = 1 << dice.roll(7),
        3 => sample.stamp_ns -= dice.roll(12 * T),
        4 => sample.stamp_ns += dice.roll(12 * T),
        5 => rig.sensors = before,
        _ => {}
    }
}

#[test]
fn a_million_random_steps_break_no_promise() {
    let mut reached = BTreeSet::new();
    let mut causes = BTreeSet::new();
    for seed in 1..=60_u64 {
        let mut dice = Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let config = GuardConfig {
            rotor_maximum: 0.3 + 0.7 * dice.unit(),
            slew_per_s: 0.5 + 30.0 * dice.unit(),
            ramp_periods: dice.roll(6) as u32,
            hold_s: 0.02 + 0.2 * dice.unit(),
            command_time_to_live_s: (dice.roll(2) == 0).then(|| 0.02 + 0.3 * dice.unit()),
            arm_checks_s: 0.1 * dice.unit(),
            bucket_limit: (dice.roll(3) == 0).then_some(2.0),
            bucket_leak: 0.1 + 0.4 * dice.unit(),
            swing_limit: 2 + dice.roll(9) as u32,
            ..defaults()
        };
        let mut rig = Rig::new(&config);
        // Calm seeds stay armed for long, rough ones never stop failing.
        let calm = 1 + seed % 5 * 40;
        // Stamps of the commands by sequence; a restarted controller begins again.
        let mut stamps = std::collections::BTreeMap::new();
        let mut arm_asked = false;
        for _ in 0..20_000 {
            let before = (rig.state.state(), rig.last);
            let pace = [T, T, T, T, T / 3, T + T / 5, 2 * T, 30 * T];
            let step = if dice.roll(calm) > 0 { T } else { pace[dice.roll(8) as usize] };
            rig.now += step;
            let asked = dice.roll(20 + 2 * calm);
            if asked < 6 {
                let stamp = if dice.roll(4) == 0 { rig.now - dice.roll(1_000_000_000) } else { rig.now };
                rig.ask_code([1, 1, 1, 2, 2, 3][asked as usize], stamp);
            } else if matches!(rig.state.state(), State::FailsafeLatched | State::EmergencyStop)
                && dice.roll(40) == 0
            {
                rig.ask(OperatorAct::Disarm);
            } else if rig.state.state() == State::Disarmed && dice.roll(10) == 0 {
                rig.ask(OperatorAct::Arm);
            } else {
                rig.request.sequence = 0;
            }
            if dice.roll(calm) > 0 {
                rig.sense();
                rig.answer();
            } else {
                random_sensors(&mut rig, &mut dice);
                random_command(&mut rig, &mut dice);
            }
            stamps.insert(rig.command.sequence, rig.command.stamp_ns);
            let request = (rig.request.sequence > 0).then_some(rig.request.act);
            let heard = dice.roll(calm + 9) > 0;
            let applied = rig.step(heard);
            let state = rig.state.state();
            reached.insert(state as u32);
            causes.extend(rig.state.take_events().map(|event| event.cause));

            for (now, then) in applied.rotor.iter().zip(before.1.rotor) {
                assert!(*now >= 0.0 && *now <= config.rotor_maximum, "{now} leaves, seed {seed}");
                let change = config.slew_per_s * step.min(T) as f64 * 1e-9;
                assert!(now - then <= change + 1e-12, "{then} to {now} in {step} ns, seed {seed}");
            }
            let turning = applied.rotor != [0.0, 0.0];
            let ramping = applied.flags & AppliedFlags::RAMPING != 0;
            assert!(!turning || state.is_active() || (state == State::FailsafeLatched && ramping));
            if turning {
                let age = rig.now.saturating_sub(stamps[&applied.command_sequence]);
                let life = rig.guard.time_to_live_ns();
                let ramp = u64::from(config.ramp_periods) * T;
                assert!(age <= life + if ramping { ramp } else { 0 }, "a command of {age} ns, seed {seed}");
            }
            if ramping {
                assert!(
                    applied.rotor.iter().zip(before.1.rotor).all(|(now, then)| *now <= then),
                    "a ramp goes down"
                );
            }
            arm_asked |= request == Some(OperatorAct::Arm as u32);
            if before.0 == State::Disarmed && state != State::Disarmed && state != State::EmergencyStop {
                assert!(arm_asked, "left `disarmed` towards {state} by itself, seed {seed}");
            }
            if matches!(before.0, State::FailsafeLatched | State::EmergencyStop) {
                let acknowledged = request == Some(OperatorAct::Disarm as u32);
                let stopped = state == State::EmergencyStop;
                assert!(
                    state == before.0 || acknowledged || stopped,
                    "{} to {state} by itself, seed {seed}",
                    before.0
                );
                assert!(!state.is_active() && state != State::PreArm);
            }
            if state == State::Disarmed {
                arm_asked = false;
            }
        }
    }
    assert_eq!(reached.len(), 6, "every state was visited");
    for cause in [
        Cause::CommandMissing,
        Cause::CommandExpired,
        Cause::CommandRepeated,
        Cause::CommandNotANumber,
        Cause::CommandFromFuture,
        Cause::CommandAnswersOldSensors,
        Cause::CommandAheadOfSensors,
        Cause::SignalStale,
        Cause::SignalOutOfRange,
        Cause::SignalNotANumber,
        Cause::TooManyMisses,
        Cause::Oscillation,
        Cause::GuardPaused,
    ] {
        assert!(causes.contains(&(cause as u32)), "{cause} never happened");
    }
}
