//! The closed loop and experiments in lockstep: the bench on virtual time.

use rotorbench::emulate::{EmulatorConfig, SensorsConfig};
use rotorbench::experiment::{ExperimentConfig, Rotors, Shape};
use rotorbench::process::lockstep;
use rotorbench::record::Dataset;

fn prbs(duration_s: f64) -> ExperimentConfig {
    let shape = Shape::Prbs { amplitude: 0.1, bandwidth_hz: 0.0, duration_s, seed: 1 };
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
