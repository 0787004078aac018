//! Benches and their experiments, run in lockstep.

use rotorbench::emulate::{Emulator, EmulatorConfig};
use rotorbench::experiment::{ExperimentConfig, Rotors, Waveform};
use rotorbench::log::Dataset;
use rotorbench::runtime::lockstep::drive;

/// [s] sampling time T_s of the paper.
pub(crate) const PERIOD: f64 = 0.02;

/// The paper's bench with one rotor running, the body clamped, sampled as the paper does.
pub(crate) fn bench(seed: u64) -> EmulatorConfig {
    let mut config = EmulatorConfig { seed, integration_step_s: 0.004, ..EmulatorConfig::default() };
    config.plant.clamped = true;
    config.sensors = config.sensors.at_rate(50.0);
    config
}

pub(crate) fn build(config: &EmulatorConfig) -> Emulator {
    config.build().expect("a bench that can be")
}

pub(crate) fn run(config: &EmulatorConfig, shape: Waveform, name: &str) -> Dataset {
    let experiment = ExperimentConfig { shape, rotors: Rotors::One, around: 0.4633, lead_in_s: 4.0 };
    let experiment = experiment.build(PERIOD).expect("an experiment that can be");
    drive(&build(config), &experiment).into_dataset(name).expect("rising time")
}

pub(crate) fn prbs(seconds: f64, seed: u64) -> Waveform {
    Waveform::Prbs { amplitude: 0.08, bandwidth_hz: 0.0, duration_s: seconds, seed }
}

/// A bench that is not the paper's, its rotors with a dead time of `delay` [s].
pub(crate) fn other_bench(seed: u64, delay: f64) -> EmulatorConfig {
    let mut config = EmulatorConfig { seed, command_delay_s: delay, ..EmulatorConfig::default() };
    let plant = &mut config.plant;
    plant.pole = 12.5;
    plant.steady_rate = vec![0.0, 1210.0, 380.0];
    plant.voltage_gain = 47.0;
    plant.thrust_coefficient = 1.75e-5;
    plant.inertia = 0.027;
    config.sensors.thrust.rate_hz = 50.0;
    config
}
