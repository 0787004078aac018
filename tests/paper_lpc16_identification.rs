//! [LPC16] section III equation by equation with the paper's numbers, and what `identify` says to bad logs.
//!
//! The logs are made here, by small steps of the differential equation: nothing is shared with the fitter.

use std::path::Path;
use std::process::{Command, Output};

use rotorbench::identify::{Identification, IdentifiedActuator, IdentifySettings, identify};
use rotorbench::record::{Dataset, log};

/// [s] T_s.
const PERIOD: f64 = 0.02;
const C_G1: f64 = 447.1;
const C_G2: f64 = 1124.5;
const K_V: f64 = 40.0;
const POLE: f64 = 16.0;
const FULL_VOLTAGE: f64 = 12.6;

fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} instead of {expected}");
}

/// z by Eq. (7) in Eq. (2), with the sign of Eq. (6).
fn z(u: f64, v: f64) -> f64 {
    C_G1 * u * u + C_G2 * u - K_V * (FULL_VOLTAGE - v)
}

/// [V] a discharge.
fn voltage(t: f64) -> f64 {
    12.4 - 0.004 * t
}

/// ω_p by Eq. (2) with the command held over T_s, in 200 midpoint steps for each sample.
fn moving(command: impl Fn(f64) -> f64, samples: usize) -> Dataset {
    let step = PERIOD / 200.0;
    let mut rate = z(command(0.0), voltage(0.0));
    let mut rates = Vec::new();
    for k in 0..samples {
        rates.push(rate);
        let u = command(k as f64 * PERIOD);
        for j in 0..200 {
            let steady = z(u, voltage(k as f64 * PERIOD + (f64::from(j) + 0.5) * step));
            let middle = rate + 0.5 * step * POLE * (steady - rate);
            rate += step * POLE * (steady - middle);
        }
    }
    dataset("moving.csv", &command, rates)
}

/// ω_p = z: Eq. (4) to the letter.
fn settled(command: impl Fn(f64) -> f64, samples: usize) -> Dataset {
    let rates = (0..samples).map(|k| k as f64 * PERIOD).map(|t| z(command(t), voltage(t))).collect();
    dataset("settled.csv", &command, rates)
}

fn dataset(name: &str, command: &dyn Fn(f64) -> f64, rates: Vec<f64>) -> Dataset {
    let time: Vec<f64> = (0..rates.len()).map(|k| k as f64 * PERIOD).collect();
    let commands = time.iter().map(|&t| command(t)).collect();
    let voltages = time.iter().map(|&t| voltage(t)).collect();
    let mut log = Dataset::new(name, "", time).expect("rising time");
    for (name, values) in
        [("command_1", commands), ("propeller_rate_1_rad_s", rates), ("battery_voltage_v", voltages)]
    {
        log.insert(name, values).expect("as long as time");
    }
    log
}

/// Six levels of 1000 samples each, Eq. (3).
fn levels(t: f64) -> f64 {
    0.35 + 0.05 * ((t + 0.5 * PERIOD) / 20.0).floor()
}

/// Up and down between 0.3 and 0.65 at 0.01 1/s.
fn ramps(t: f64) -> f64 {
    0.3 + 0.01 * (35.0 - (t.rem_euclid(70.0) - 35.0).abs())
}

/// Four levels that nobody can foretell, each for 0.1 s: a multiplicative hash of the slot's number.
fn lively(t: f64) -> f64 {
    let slot = ((t + 0.5 * PERIOD) / 0.1).floor() as u32;
    let hash = slot.wrapping_mul(2_654_435_761) ^ (slot.wrapping_mul(40_503) >> 7);
    0.35 + 0.08 * f64::from((hash >> 13) % 4)
}

fn found(logs: &[Dataset], degree: Option<usize>) -> Identification {
    identify(logs, &[], &IdentifySettings { degree, ..IdentifySettings::default() }).expect("identified")
}

fn paper() -> IdentifiedActuator {
    IdentifiedActuator {
        coefficients: vec![C_G2, C_G1],
        voltage_gain: K_V,
        full_voltage: FULL_VOLTAGE,
        pole: POLE,
        thrust_coefficient: 1.5965e-5,
    }
}

#[test]
fn eq_2_with_the_command_held() {
    let log = moving(lively, 500);
    let column = |name: &str| log.column(name).expect("put in above");
    let rates = paper().simulate(log.time(), column("command_1"), log.column("battery_voltage_v"));
    for (ours, measured) in rates.iter().zip(column("propeller_rate_1_rad_s")) {
        // The model holds the voltage over T_s, the bench above lets it fall: k_V 0.004 V/s 0.02 s at most,
        // and the midpoint rule is off by (p h)²/6 of the way, 4e-7 of 600 rad/s.
        close(*ours, *measured, K_V * 0.004 * PERIOD + 3e-4);
    }
}

#[test]
fn eq_4_the_stationary_gain_is_one() {
    let time: Vec<f64> = (0..200).map(|k| f64::from(k) * PERIOD).collect();
    let mut command = vec![0.3; 200];
    command[1..].fill(0.4633);
    let rates = paper().simulate(&time, &command, Some(&[11.6; 200]));
    // Four seconds are 64 time constants.
    close(rates[199], z(0.4633, 11.6), 1e-9);
    close(rates[199], 616.95 - 40.0, 0.05);
    // One time constant after the jump: 1 - 1/e of the way, as near as the grid comes to 62.5 ms.
    let share = (rates[4] - rates[1]) / (rates[199] - rates[1]);
    close(share, 1.0 - (-POLE * 3.0 * PERIOD).exp(), 1e-9);
}

#[test]
fn eqs_3_5_6_k_v_from_constant_commands() {
    let found = found(&[settled(levels, 6000)], None);
    let battery = found.battery.expect("six constant levels");
    assert_eq!(battery.levels.len(), 6);
    // Without noise Eq. (6) as printed and with the mean subtracted say the same.
    for level in &battery.levels {
        close(level.gain.value, K_V, 1e-6);
        close(level.as_printed, K_V, 1e-6);
    }
    close(battery.gain.value, K_V, 1e-6);
    close(battery.spread, 0.0, 1e-6);
}

#[test]
fn eqs_7_8_9_the_polynomial_from_ramps() {
    let found = found(&[settled(levels, 6000), settled(ramps, 7000)], None);
    let curve = found.static_curve.expect("ramps");
    assert!(curve.from_ramps);
    assert_eq!(curve.preferred_degree, 2);
    close(curve.coefficients[0].value, C_G2, 1e-4);
    close(curve.coefficients[1].value, C_G1, 1e-4);
    // Of degree one there must be an error left, of three none that is less.
    assert!(curve.degrees[0].held_out > 10.0 && curve.degrees[2].held_out < 1e-6, "{:?}", curve.degrees);
}

#[test]
fn eq_9_says_when_a_ramp_is_too_fast_for_eq_4() {
    let fast = |t: f64| 0.3 + 0.1 * (3.5 - (t.rem_euclid(7.0) - 3.5).abs());
    let slow = found(&[settled(levels, 6000), moving(ramps, 7000)], Some(2));
    let fast = found(&[settled(levels, 6000), moving(fast, 7000)], Some(2));
    let slow = slow.static_curve.and_then(|curve| curve.ramp_check).expect("ramps");
    assert!(slow.slow_enough, "{slow:?}");
    // 1/p, and half of T_s for the hold.
    close(slow.lag.value, 1.0 / POLE + 0.5 * PERIOD, 2e-3);
    let check = fast.static_curve.and_then(|curve| curve.ramp_check).expect("ramps");
    assert!(!check.slow_enough, "{check:?}");
    assert!(
        fast.warnings.iter().any(|warning| warning.contains("too fast for Eq. (4)")),
        "{:?}",
        fast.warnings
    );
}

#[test]
fn eq_10_the_pole_from_z() {
    let logs = [settled(levels, 6000), settled(ramps, 7000), moving(lively, 6000)];
    let found = found(&logs, Some(2));
    let fit = found.pole.expect("lively commands");
    // What the fitter takes as held, the mean of the voltage over T_s, moves the rate by 1e-6 of itself.
    close(fit.pole.value, POLE, 1e-3);
    close(fit.gain.value, 1.0, 1e-4);
    let joint = found.joint.expect("lively commands");
    close(joint.pole.value, POLE, 1e-3);
    close(joint.coefficients[1].value, C_G1, 0.1);
    close(joint.voltage_gain.expect("voltage was logged").value, K_V, 0.05);
}

/// `identify` on one log in a folder of its own; the model file must appear exactly when it succeeds.
fn run(log: &str) -> (Output, String) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (file, model) = (folder.path().join("log.csv"), folder.path().join("model.toml"));
    std::fs::write(&file, log).expect("written");
    let output = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args([Path::new("identify"), Path::new("--log"), &file, Path::new("-o"), &model])
        .output()
        .expect("the program starts");
    assert_eq!(output.status.success(), model.exists(), "a model file exactly when there is a model");
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    (output, String::from_utf8_lossy(&text).into_owned())
}

/// The sentence, and exit 2.
fn refused(log: &str, sentence: &str) {
    let (output, text) = run(log);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains(sentence), "`{sentence}` is not in: {text}");
}

#[test]
fn too_few_samples_are_counted() {
    let toggling = |t: f64| if (t / PERIOD).round() % 2.0 == 0.0 { 0.4 } else { 0.5 };
    refused(
        &log::emit(&moving(toggling, 30)),
        "only 30 usable samples of command and rate, 100 are the least",
    );
}

#[test]
fn no_excitation_says_what_excites() {
    let still = log::emit(&settled(|_| 0.4, 200));
    refused(&still, "steps or a PRBS excite the pole");
    refused(&still, "no command was held constant for five seconds");
}

#[test]
fn saturated_commands_are_told() {
    refused(&log::emit(&settled(|_| 1.0, 200)), "the command is at its limit 1 in 100 % of the samples");
    // Where some are, the rest can still be used.
    let (output, text) = run(&log::emit(&moving(|t| (lively(t) + 0.45).min(1.0), 3000)));
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("the command is at its limit 1 in"), "{text}");
}

#[test]
fn time_running_backwards_is_placed() {
    let mut lines: Vec<String> = log::emit(&moving(lively, 500)).lines().map(str::to_owned).collect();
    lines.swap(100, 101);
    refused(&lines.join("\n"), "time");
}

#[test]
fn wrong_units_are_refused() {
    let with = |name: &str, change: &dyn Fn(f64) -> f64| {
        let mut log = moving(lively, 500);
        let changed = log.column(name).expect("put in above").iter().map(|value| change(*value)).collect();
        log.replace(name, changed).expect("as long as before");
        log::emit(&log)
    };
    refused(&with("command_1", &|u| 1000.0 + 1000.0 * u), "but 0 to 1 is expected");
    let rpm = 60.0 / std::f64::consts::TAU;
    refused(
        &with("propeller_rate_1_rad_s", &|w| rpm * w),
        "if the column is in rpm, import it with unit `rpm`",
    );
    refused(&with("battery_voltage_v", &|v| 1000.0 * v), "millivolts");
}

#[test]
fn without_the_battery_the_rest_is_identified_and_said_so() {
    let text = log::emit(&moving(lively, 3000));
    let text = text.replace("battery_voltage_v", "something_else_v");
    let (output, text) = run(&text);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("no column `battery_voltage_v`"), "{text}");
    assert!(text.contains("they hold for the charge at which the log was made"), "{text}");
}
