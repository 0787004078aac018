//! What `identify` says to bad logs.

use std::path::Path;
use std::process::{Command, Output};

use rotorbench::identify::{IdentifyError, IdentifySettings, identify};
use rotorbench::log::{Dataset, csv};
use rotorbench::screening::{Finding, ScreeningError, screened};

use super::logs::{PERIOD, attitude, exciting, moving, steady};

/// `identify` on one log in a folder of its own; the model file must appear exactly when it succeeds.
pub fn run(log: &str) -> (Output, String) {
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

/// What `identify` finds in one log, whether it makes a model of it or not.
pub fn found_in(log: &str) -> Vec<Finding> {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    std::fs::write(&file, log).expect("written");
    let log = csv::read(file.path()).expect("a log");
    match identify(&screened(&[log]), &[], &IdentifySettings::default()) {
        Ok(found) => found.findings,
        Err(IdentifyError::Nothing { reasons, steps }) => {
            let causes: Vec<Finding> = reasons.iter().filter_map(|it| it.cause().cloned()).collect();
            [reasons, causes, steps.into_iter().map(|part| part.finding).collect()].concat()
        }
        Err(IdentifyError::Screening(ScreeningError::Column(finding))) => vec![*finding],
        Err(other) => panic!("{other}"),
    }
}

/// The finding of this code, and exit 2.
pub fn refused(log: &str, code: &str) -> Finding {
    let (output, text) = run(log);
    assert_eq!(output.status.code(), Some(2), "{text}");
    let found = found_in(log);
    let codes: Vec<&str> = found.iter().map(|it| it.code).collect();
    found.iter().find(|it| it.code == code).unwrap_or_else(|| panic!("{code}: {codes:?}")).clone()
}

#[test]
fn a_model_that_was_there_is_replaced_only_by_force() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (file, model) = (folder.path().join("log.csv"), folder.path().join("model.toml"));
    std::fs::write(&file, csv::emit(&moving(exciting, 1000))).expect("written");
    let ended = |force: &[&str]| {
        let program = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
            .args([Path::new("identify"), Path::new("--log"), &file, Path::new("-o"), &model])
            .args(force)
            .output()
            .expect("the program starts");
        assert!(model.exists());
        program.status.code()
    };
    assert_eq!([ended(&[]), ended(&[]), ended(&["--force"])], [Some(0), Some(2), Some(0)]);
}

#[test]
fn too_few_samples_are_counted() {
    let toggling = |t: f64| if (t / PERIOD).round() % 2.0 == 0.0 { 0.4 } else { 0.5 };
    let few = refused(&csv::emit(&moving(toggling, 30)), "too_few_samples");
    assert_eq!(["samples", "samples_needed"].map(|name| few.count(name)), [30, 100]);
}

#[test]
fn no_excitation_says_what_excites() {
    let still = csv::emit(&steady(|_| 0.4, 200));
    refused(&still, "too_few_jumps");
    refused(&still, "no_constant_commands");
}

#[test]
fn saturated_commands_are_found() {
    let all = refused(&csv::emit(&steady(|_| 1.0, 200)), "command_saturated");
    assert_eq!(["at", "share"].map(|name| all.number(name)), [1.0, 1.0]);
    // Where some are, the rest can still be used.
    let log = csv::emit(&moving(|t| (exciting(t) + 0.45).min(1.0), 3000));
    let (output, text) = run(&log);
    assert_eq!(output.status.code(), Some(0), "{text}");
    let found = found_in(&log);
    let some = found.iter().find(|it| it.code == "command_saturated").expect("found");
    assert!(some.number("at") == 1.0 && some.number("share") < 1.0, "{some}");
}

#[test]
fn time_running_backwards_is_placed() {
    let mut lines: Vec<String> = csv::emit(&moving(exciting, 500)).lines().map(str::to_owned).collect();
    lines.swap(100, 101);
    let (output, text) = run(&lines.join("\n"));
    assert_eq!(output.status.code(), Some(2), "{text}");
    // The place of an error is said by the error.
    assert!(text.contains("time"), "{text}");
}

#[test]
fn wrong_units_are_refused() {
    let with = |name: &str, change: &dyn Fn(f64) -> f64| {
        let mut log = moving(exciting, 500);
        let changed = log.column(name).expect("put in above").iter().map(|value| change(*value)).collect();
        log.replace(name, changed).expect("as long as before");
        csv::emit(&log)
    };
    refused(&with("command_1", &|u| 1000.0 + 1000.0 * u), "command_out_of_range");
    let rpm = 60.0 / std::f64::consts::TAU;
    refused(&with("propeller_rate_1_rad_s", &|w| rpm * w), "rate_too_fast");
    let millivolts = refused(&with("battery_voltage_v", &|v| 1000.0 * v), "battery_in_other_unit");
    assert_eq!(millivolts.text("unit"), "mV");
    let percent = found_in(&with("battery_voltage_v", &|v| 100.0 - 3.0 * (12.4 - v)));
    let percent = percent.iter().find(|it| it.code == "battery_voltage_too_high").expect("found");
    assert_eq!(percent.text("unit"), "");
    refused(&with("propeller_rate_1_rad_s", &|w| -w), "rate_negative");
}

#[test]
fn a_rotor_that_stands_while_it_is_commanded_does_not_count_as_turned_round() {
    let mut log = moving(exciting, 500);
    // Noise about zero, a little more of it below: another rotor's commands, or a rotor that is not connected.
    let noise = |row: usize| f64::from((row.wrapping_mul(2_654_435_761) >> 24 & 255) as u8) / 64.0 - 2.1;
    log.replace("propeller_rate_1_rad_s", (0..500).map(noise).collect()).expect("as long as before");
    let text = csv::emit(&log);
    refused(&text, "rotor_does_not_turn");
    assert!(found_in(&text).iter().all(|it| it.code != "rate_negative"));
}

#[test]
fn commands_that_are_missing_are_found_as_that() {
    let text = csv::emit(&moving(exciting, 500)).replace("command_1", "throttle");
    assert_eq!(refused(&text, "log_not_used").text("reason"), "no_commands");
}

#[test]
fn a_pole_that_no_rotor_has_asks_for_the_unit_of_time() {
    let log = moving(exciting, 6000);
    // A twentieth: 320 rad/s.
    let mut fast =
        Dataset::new("fast.csv", "", log.time().iter().map(|time| time / 20.0).collect()).expect("rises");
    for name in ["command_1", "propeller_rate_1_rad_s", "battery_voltage_v"] {
        fast.insert(name, log.column(name).expect("there").to_vec()).expect("as long as time");
    }
    let is_too_fast = |log: &Dataset| found_in(&csv::emit(log)).iter().any(|it| it.code == "pole_too_fast");
    assert_eq!([log, fast].each_ref().map(is_too_fast), [false, true]);
}

#[test]
fn without_the_battery_the_rest_is_identified_and_said_so() {
    let text = csv::emit(&moving(exciting, 3000));
    let text = text.replace("battery_voltage_v", "something_else_v");
    let (output, said) = run(&text);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(found_in(&text).iter().any(|it| it.code == "battery_not_logged"), "{said}");
}

#[test]
fn a_body_in_degrees_has_no_inertia_and_the_rotors_are_identified_all_the_same() {
    let turned = |by: f64| attitude(move |t| by * (exciting(t) - 0.47), 1500);
    // Less than 60 deg/s, and more than that.
    let (radians, fast) = (turned(0.008), turned(0.25));
    let degrees = |log: &Dataset, names: &[&str]| {
        let mut log = log.clone();
        for name in names {
            let changed = log.column(name).expect("there").iter().map(|value| value.to_degrees()).collect();
            log.replace(name, changed).expect("as long as before");
        }
        csv::emit(&log)
    };
    let with_angle = |log: &Dataset| {
        let rate = log.column("body_rate_rad_s").expect("there");
        let mut angle = 0.0;
        let angles = rate.iter().map(|rate| {
            angle += rate * PERIOD;
            angle
        });
        let angles = angles.collect();
        let mut log = log.clone();
        log.insert("body_angle_rad", angles).expect("as long as time");
        log
    };
    let both = with_angle(&radians);
    let (rate, angle) = ("body_rate_rad_s", "body_angle_rad");
    for (log, code, has_inertia) in [
        (degrees(&with_angle(&fast), &[rate]), "body_rate_in_degrees", false),
        (degrees(&both, &[rate, angle]), "body_turns_over", true),
        (degrees(&fast, &[rate]), "body_rate_too_fast", false),
        (degrees(&both, &[angle]), "body_angle_in_degrees", true),
        (degrees(&radians, &[rate]), "inertia_in_degrees", true),
    ] {
        let (output, text) = run(&log);
        assert_eq!(output.status.code(), Some(0), "{text}");
        let found = found_in(&log);
        assert!(found.iter().any(|it| it.code == code), "{code} is not in: {found:?}");
        assert_eq!(text.contains("d/J"), has_inertia, "{text}");
    }
    // Where there is nothing else, that is the end of it.
    let mut alone = Dataset::new("attitude.csv", "", both.time().to_vec()).expect("rising time");
    for name in [rate, angle] {
        alone.insert(name, both.column(name).expect("there").to_vec()).expect("as long as time");
    }
    refused(&degrees(&alone, &[rate]), "body_rate_in_degrees");
}
