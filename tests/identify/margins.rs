//! The loop that `design` promises for an identified model, measured on the bench.

use std::f64::consts::{PI, TAU};
use std::process::Command;

use nalgebra::Complex;
use rotorbench::bench::BenchConfig;
use rotorbench::control::{Allocator, Controller, ControllerConfig, ControllerKind};
use rotorbench::emulate::SensorConfig;
use rotorbench::experiment::{ExperimentConfig, Rotors, Waveform};
use rotorbench::identify::{IdentifySettings, identify};
use rotorbench::model::Model;
use rotorbench::runtime::experiment::{Ending, in_lockstep};
use rotorbench::runtime::{ExperimentPlan, controller_plant};
use rotorbench::screening::screened;
use rotorbench::signal::{Applied, Reference};
use serde_json::Value;

use crate::json_schema;

use super::bench::{PERIOD, build, other_bench, prbs, run};

/// The model of a bench, from a PRBS on one rotor with the body clamped, and a differential PRBS on the paper's
/// controller, which does not know the bench, with the body free.
fn identified(seed: u64, delay: f64) -> Model {
    let mut clamped = other_bench(seed, delay);
    clamped.plant.clamped = true;
    clamped.sensors = clamped.sensors.at_rate(50.0);
    let rotors = run(&clamped, prbs(240.0, 3), "rotors");
    let bench = BenchConfig { emulator: other_bench(seed + 1, delay), ..BenchConfig::default() };
    let shape = Waveform::Prbs { amplitude: 0.03, bandwidth_hz: 0.0, duration_s: 60.0, seed: 4 };
    let experiment = ExperimentConfig { shape, rotors: Rotors::Differential, around: 0.4633, lead_in_s: 4.0 };
    let plan = ExperimentPlan { closed_loop: true, experiment };
    let (body, ending) = in_lockstep(&bench, &plan, &mut (), |_| true).expect("an experiment that can be");
    assert_eq!(ending, Ending::Complete);
    let logs = [rotors, body.into_dataset("body").expect("rising time")];
    let found =
        identify(&screened(&logs), &[], &IdentifySettings { degree: Some(2), ..IdentifySettings::default() })
            .expect("identified");
    let (truth, model) = (other_bench(seed, delay).plant, &found.model);
    for (name, value, truth) in [
        ("p", model.actuator.pole, truth.pole),
        ("c_g2", model.actuator.steady_rate[1], truth.steady_rate[1]),
        ("c_g1", model.actuator.steady_rate[2], truth.steady_rate[2]),
        ("k_V", model.actuator.voltage_gain, truth.voltage_gain),
        ("c", model.actuator.thrust_coefficient, truth.thrust_coefficient),
        ("J", model.body.inertia, truth.inertia),
    ] {
        let error = model.standard_errors.get(match name {
            "p" => "pole",
            "c_g2" => "steady_rate_linear",
            "c_g1" => "steady_rate_quadratic",
            "k_V" => "voltage_gain",
            "c" => "thrust_coefficient",
            _ => "inertia",
        });
        println!("{name} {value} truth {truth} off {:+.2e} ± {error:?}", value / truth - 1.0);
        assert!((value / truth - 1.0).abs() < 0.02, "{name}: {value} instead of {truth}");
    }
    let identified = model.parameter("transport_delay.delay");
    println!("delay {identified:?} truth {delay}");
    // A fiftieth of a sample; a bench without dead time gets no delay at all.
    assert!(identified.is_some_and(|it| (it - delay).abs() < 4e-4) || (identified.is_none() && delay == 0.0));
    found.model
}

/// What `rotorbench design` promises for a model file.
fn promised(model: &Model, controller: &str) -> Value {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("model.toml");
    model.save(&file).expect("written");
    let output = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args(["design", "--json", "--controller", controller, "--model"])
        .arg(&file)
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    json_schema::answer("design", &output.stdout)
}

/// Slots of one window of the sweep: 8 s.
const WINDOW: u32 = 400;

/// L at one frequency, `cycles` in each [`WINDOW`], in closed loop on the emulated bench: a sine is added to the torque
/// that the controller of `model` commands, which does not know of it, and its answer is correlated with the sine.
fn swept(model: &Model, delay: f64, kind: ControllerKind, cycles: u32) -> Complex<f64> {
    let (parameters, known) = controller_plant::of_model(model).expect("a parabola");
    let config = ControllerConfig { kind, ..ControllerConfig::default() };
    let controller = config.build_compensated(&parameters, &known, PERIOD).expect("stable");
    let allocator = Allocator::build(&parameters, &known).expect("a parabola");
    let mut bench = other_bench(50, delay);
    // The loop is measured, not its noise.
    bench.sensors.body_rate = SensorConfig { rate_hz: 1.0 / PERIOD, noise: 0.0, quantization: 0.0 };
    let emulator = build(&bench);
    let mut body = emulator.start(1_000_000_000);
    let mut state = controller.start();
    let mut last = Applied::default();
    let turn = TAU * f64::from(cycles) / f64::from(WINDOW);
    let (amplitude, mut sum) = (0.02, Complex::new(0.0, 0.0));
    // 16 s for the start to be forgotten, then two windows.
    for k in 0..4 * WINDOW {
        let sensors = *body.sensors();
        let mut command = controller.step(&mut state, &sensors, &Reference::default(), &last);
        command.sequence = u64::from(k) + 1;
        let sine = amplitude * (turn * f64::from(k)).sin();
        let difference = (command.torque + sine) / (parameters.arm * parameters.thrust_slope);
        let rotor = allocator.allocate(difference, sensors.battery_voltage.value).rotor;
        if k >= 2 * WINDOW {
            sum += Complex::from_polar(1.0, -turn * f64::from(k)) * command.torque;
        }
        emulator.command(&mut body, rotor);
        emulator.advance(&mut body, u64::from(k + 1) * 20_000_000);
        let sequence = command.sequence;
        last = Applied { sequence, command_sequence: sequence, rotor: command.rotor, ..Applied::default() };
    }
    let answer = emulator.truth(&body).body_rate;
    assert!(answer.abs() < 0.5, "{kind:?}: the loop is not stable, {answer} rad/s");
    // Σ a sin(ωk + φ) e^(-iωk) = a n / (2i) e^(iφ); T = L / (1 + L), and the controller answers with minus T.
    let complementary = -sum * Complex::new(0.0, 2.0) / (amplitude * f64::from(2 * WINDOW));
    complementary / (Complex::new(1.0, 0.0) - complementary)
}

/// Must be true 3: what is measured on the bench agrees with what `design` promised from the identified model.
#[test]
fn an_identified_model_gives_the_loop_that_design_promised() {
    is_as_promised(0.0, "pid", ControllerKind::Pid);
}

fn is_as_promised(delay: f64, name: &str, kind: ControllerKind) {
    let model = identified(31, delay);
    let design = promised(&model, name);
    assert_eq!(design["stable"].as_bool(), Some(true), "{design:#}");
    let margin = |key: &str| design["margins"][key].as_f64().expect("a number");
    // From 0.8 to 113 rad/s, each 12 % above the one before where whole cycles allow it.
    let mut points: Vec<(f64, Complex<f64>)> = Vec::new();
    let mut cycles = 1.0_f64;
    while cycles < 145.0 {
        let whole = cycles.round() as u32;
        let frequency = TAU * f64::from(whole) / (f64::from(WINDOW) * PERIOD);
        if points.last().is_none_or(|last| last.0 < frequency) {
            points.push((frequency, swept(&model, delay, kind, whole)));
        }
        cycles *= 1.12;
    }
    let measured = margins(&points);
    let pairs = [
        ("gain may grow by", measured.gain_up, margin("gain_up")),
        ("phase margin [rad]", measured.phase, margin("phase_rad")),
        ("crossover [rad/s]", measured.crossover, margin("crossover_rad_s")),
        ("further delay [s]", measured.delay, margin("delay_s")),
    ];
    for (what, measured, promised) in pairs {
        println!("{name}, {delay} s: {what}: promised {promised:.4}, measured {measured:.4}");
        // The model is off by 0.5 % in c/J and 0.1 % in p (above), which is as much of gain and crossover and up to
        // three times that of a margin; straight lines between points 12 % apart cost another 0.5 %.
        let off = (measured / promised - 1.0).abs();
        assert!(off < 0.02, "{name}: {what}: promised {promised}, measured {measured}");
    }
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    #[test]
    fn an_identified_model_gives_the_loop_with_emc_that_design_promised() {
        is_as_promised(0.0, "emc", ControllerKind::Emc);
        // With a delay of one and a half periods PID has no margin left that could be compared.
        is_as_promised(0.03, "emc", ControllerKind::Emc);
    }
}

struct MeasuredMargins {
    gain_up: f64,
    phase: f64,
    crossover: f64,
    delay: f64,
}

/// Margins of a measured L, by straight lines between its points over the logarithm of the frequency.
fn margins(points: &[(f64, Complex<f64>)]) -> MeasuredMargins {
    let mut found =
        MeasuredMargins { gain_up: f64::INFINITY, phase: PI, crossover: 0.0, delay: f64::INFINITY };
    for pair in points.windows(2) {
        let [(f_0, l_0), (f_1, l_1)] = [pair[0], pair[1]];
        // Magnitude and phase go almost straight; the phase is unwound across the cut.
        let phase_0 = l_0.arg().rem_euclid(TAU);
        let phase_1 = phase_0 + (l_1.arg() - l_0.arg() + PI).rem_euclid(TAU) - PI;
        let between = |share: f64, low: f64, high: f64| low + share * (high - low);
        let (gain_0, gain_1) = (l_0.norm().ln(), l_1.norm().ln());
        if (gain_0 > 0.0) != (gain_1 > 0.0) {
            let share = gain_0 / (gain_0 - gain_1);
            let frequency = between(share, f_0.ln(), f_1.ln()).exp();
            // How far L may turn clockwise before it is at -1.
            let turn = (between(share, phase_0, phase_1) - PI).rem_euclid(TAU);
            let distance = turn.min(TAU - turn);
            if distance < found.phase {
                (found.phase, found.crossover) = (distance, frequency);
            }
            found.delay = found.delay.min(turn / frequency);
        }
        if (phase_0 > PI) != (phase_1 > PI) {
            let share = (PI - phase_0) / (phase_1 - phase_0);
            let gain = between(share, gain_0, gain_1);
            if gain < 0.0 {
                found.gain_up = found.gain_up.min((-gain).exp());
            }
        }
    }
    found
}
