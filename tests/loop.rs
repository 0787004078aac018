//! The closed loop and experiments in lockstep: the bench on virtual time.

use rotorbench::control::{ControllerConfig, ControllerKind, PlantParameters};
use rotorbench::emulate::{EmulatorConfig, Impulse, SensorsConfig};
use rotorbench::experiment::{ExperimentConfig, Rotors, Waveform};
use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::log::Dataset;
use rotorbench::runtime::command_source::CommandSource;
use rotorbench::runtime::lockstep::{self, Interference, Lockstep, Slot};
use rotorbench::signal::{Command, GuardEvent, Health, Sensors};

fn prbs(duration_s: f64) -> ExperimentConfig {
    let shape = Waveform::Prbs { amplitude: 0.1, bandwidth_hz: 0.0, duration_s, seed: 1 };
    ExperimentConfig { shape, rotors: Rotors::One, around: 0.46, lead_in_s: 2.0 }
}

fn log(config: &EmulatorConfig, experiment: &ExperimentConfig) -> Dataset {
    let emulator = config.build().expect("valid emulator");
    let experiment = experiment.build(0.02).expect("valid experiment");
    lockstep::drive(&emulator, &experiment).into_dataset("lockstep").expect("time rises")
}

#[test]
fn an_actuator_experiment_logs_each_slot_with_what_was_commanded_and_measured() {
    let config =
        EmulatorConfig { sensors: SensorsConfig::default().at_rate(50.0), ..EmulatorConfig::default() };
    let log = log(&config, &prbs(20.0));
    assert_eq!(log.len(), 1000);
    assert!((log.time()[999] - 19.98).abs() < 1e-9);
    let rate = log.column("propeller_rate_1_rad_s").expect("measured");
    let command = log.column("command_1").expect("commanded");
    assert!(command.iter().all(|u| (u - 0.56).abs() < 1e-9 || (u - 0.36).abs() < 1e-9));
    // A row holds what was measured before its command acts, and the command is held to the next row.
    let z = |u: f64, v: f64| 447.1 * u * u + 1124.5 * u - 40.0 * (12.6 - v);
    let voltage = log.column("battery_voltage_v").expect("measured");
    let decay = (-16.0_f64 * 0.02).exp();
    let mut square = 0.0;
    for k in 0..999 {
        let steady = z(command[k], voltage[k]);
        square += (rate[k + 1] - (steady + (rate[k] - steady) * decay)).powi(2);
    }
    // Noise of 1.5 rad/s on both rates and of 0.01 V on the voltage: 1.5 √(1 + decay²) ≈ 1.85.
    let rms = f64::sqrt(square / 999.0);
    assert!((1.6..2.2).contains(&rms), "{rms}");
}

#[test]
fn a_slow_sensor_leaves_empty_cells_instead_of_repeating_itself() {
    let mut config = EmulatorConfig::default();
    config.sensors.battery_voltage.rate_hz = 10.0;
    let log = log(&config, &prbs(2.0));
    let voltage = log.column("battery_voltage_v").expect("measured");
    assert_eq!(voltage.iter().filter(|value| value.is_finite()).count(), 20);
}

#[test]
fn runs_repeat_bit_for_bit() {
    let config = EmulatorConfig::default();
    let (first, second) = (log(&config, &prbs(5.0)), log(&config, &prbs(5.0)));
    for name in first.names() {
        let bits = |log: &Dataset| -> Vec<u64> {
            log.column(name).expect("there").iter().map(|value| value.to_bits()).collect()
        };
        assert_eq!(bits(&first), bits(&second), "{name}");
    }
}

/// A bench of the default emulator with one torque impulse each 5 s, and the controller of `kind`.
fn attitude(kind: ControllerKind, emulator: &EmulatorConfig, period_s: f64) -> Lockstep {
    let controller = ControllerConfig { kind, ..ControllerConfig::default() };
    let built = controller.build(&PlantParameters::paper(), period_s).expect("stable");
    let reference = controller.reference.build(period_s).expect("valid");
    let emulator = emulator.build().expect("valid");
    Lockstep::new(emulator, CommandSource::controller(built, reference), period_s)
}

fn with_impulses() -> EmulatorConfig {
    EmulatorConfig {
        impulse: vec![
            Impulse { at_s: 5.0, duration_s: 0.05, torque: 0.6 },
            Impulse { at_s: 10.0, duration_s: 0.05, torque: -0.6 },
        ],
        impulse_period_s: 10.0,
        ..EmulatorConfig::default()
    }
}

fn guarded(kind: ControllerKind, emulator: &EmulatorConfig, period_s: f64) -> Lockstep {
    let guard = GuardConfig::default().build(period_s).expect("valid");
    attitude(kind, emulator, period_s).guarded(guard)
}

fn peak_angle(slots: &[Slot], from: f64, to: f64) -> f64 {
    slots
        .iter()
        .filter(|slot| (from..to).contains(&slot.time))
        .fold(0.0, |peak: f64, slot| peak.max(slot.truth.body_angle.abs()))
}

#[test]
fn both_controllers_hold_the_angle_through_torque_impulses_at_three_rates() {
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        for period_s in [0.02, 0.005, 0.001] {
            let slots = guarded(kind, &with_impulses(), period_s).run(60.0, &mut ());
            assert!(
                slots.iter().skip_while(|slot| slot.applied.state < 2).all(|slot| slot.applied.state == 2)
            );
            let struck = peak_angle(&slots, 5.0, 6.0);
            assert!(
                (0.02..0.2).contains(&struck),
                "{kind:?} at {period_s} s: {struck} rad after the impulse"
            );
            let settled = peak_angle(&slots, 57.0, 60.0);
            // The angle is the integral of the gyro: its noise of 0.004 rad/s alone makes it walk by
            // 0.004 √(0.02 s · 60 s) = 0.0044 rad rms; four times that.
            assert!(settled < 0.018, "{kind:?} at {period_s} s: {settled} rad at the end");
        }
    }
}

/// One fault from a slot on; remembers what the guard said.
struct Fault {
    from: u64,
    kind: FaultKind,
    events: Vec<GuardEvent>,
    frozen: Option<Sensors>,
}

#[derive(Debug, Clone, Copy)]
enum FaultKind {
    ControllerSilent,
    ControllerResends,
    CommandNotANumber,
    GyroSilent,
    GyroFrozen,
    EmergencyStop,
}

impl Interference for Fault {
    fn sensors(&mut self, slot: u64, sensors: &mut Sensors) {
        let frozen = *self.frozen.get_or_insert(*sensors);
        if slot < self.from {
            self.frozen = Some(*sensors);
            return;
        }
        match self.kind {
            FaultKind::GyroSilent => sensors.body_rate = frozen.body_rate,
            FaultKind::GyroFrozen => sensors.body_rate.value = frozen.body_rate.value,
            _ => {}
        }
        assert_eq!(sensors.body_rate.health & Health::NEVER, 0);
    }

    fn command(&mut self, slot: u64, command: Command) -> Option<Command> {
        match self.kind {
            FaultKind::ControllerSilent if slot >= self.from => None,
            // The same sequence for ever, however fresh its stamp.
            FaultKind::ControllerResends if slot >= self.from => {
                Some(Command { sequence: self.from, ..command })
            }
            FaultKind::CommandNotANumber if slot >= self.from => {
                Some(Command { rotor: [f64::NAN, command.rotor[1]], ..command })
            }
            _ => Some(command),
        }
    }

    fn act(&mut self, slot: u64) -> Option<OperatorAct> {
        match self.kind {
            _ if slot == 0 => Some(OperatorAct::Arm),
            FaultKind::EmergencyStop if slot == self.from => Some(OperatorAct::Stop),
            _ => None,
        }
    }

    fn event(&mut self, event: &GuardEvent) {
        self.events.push(*event);
    }
}

/// Every fault ends in the safe command, for its own reason, within the hold limit and two periods; the run
/// neither hangs nor differs from the next one.
#[test]
fn failsafe_paths_run_in_virtual_time_and_repeat() {
    use FaultKind as F;
    let expected = [
        (F::ControllerSilent, State::FailsafeLatched, Cause::CommandMissing),
        (F::ControllerResends, State::FailsafeLatched, Cause::CommandRepeated),
        (F::CommandNotANumber, State::FailsafeLatched, Cause::CommandNotANumber),
        (F::GyroSilent, State::FailsafeLatched, Cause::SignalStale),
        (F::GyroFrozen, State::FailsafeLatched, Cause::SignalFrozen),
        (F::EmergencyStop, State::EmergencyStop, Cause::OperatorStop),
    ];
    for period_s in [0.02, 0.001] {
        let from = (2.0 / period_s) as u64;
        for (kind, state, cause) in expected {
            let repeat = || {
                let mut fault = Fault { from, kind, events: Vec::new(), frozen: None };
                let slots = guarded(ControllerKind::Emc, &with_impulses(), period_s).run(3.0, &mut fault);
                (slots, fault.events)
            };
            let (slots, events) = repeat();
            let last = slots.last().expect("slots");
            assert_eq!((last.applied.state, last.applied.cause), (state as u32, cause as u32), "{kind:?}");
            let safe = slots.iter().position(|slot| slot.slot >= from && slot.applied.rotor == [0.0; 2]);
            let periods = safe.expect("safe") as u64 - from;
            let guard = GuardConfig::default().build(period_s).expect("valid");
            let limit = u64::from(guard.hold_periods()) + 2;
            assert!(periods <= limit, "{kind:?} at {period_s} s: safe after {periods} of {limit} periods");
            println!("{kind:?} at {period_s} s: safe after {periods} periods");
            assert!(slots.iter().skip(safe.expect("safe")).all(|slot| slot.applied.rotor == [0.0; 2]));
            // As text: one command is not a number, which equals nothing.
            assert!(
                format!("{:?}", (slots, events)) == format!("{:?}", repeat()),
                "{kind:?} does not repeat"
            );
        }
    }
}
