//! What `identify` says to bad logs.

use std::path::Path;
use std::process::{Command, Output};

use rotorbench::log::{Dataset, csv};

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

/// The sentence, and exit 2.
fn refused(log: &str, sentence: &str) {
    let (output, text) = run(log);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains(sentence), "`{sentence}` is not in: {text}");
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
    refused(
        &csv::emit(&moving(toggling, 30)),
        "only 30 usable samples of command and rate, 100 are the least",
    );
}

#[test]
fn no_excitation_says_what_excites() {
    let still = csv::emit(&steady(|_| 0.4, 200));
    refused(&still, "steps or a PRBS excite the pole");
    refused(&still, "no command was held constant for five seconds");
}

#[test]
fn saturated_commands_are_found() {
    refused(&csv::emit(&steady(|_| 1.0, 200)), "the command is at its limit 1 in 100 % of the samples");
    // Where some are, the rest can still be used.
    let (output, text) = run(&csv::emit(&moving(|t| (exciting(t) + 0.45).min(1.0), 3000)));
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("the command is at its limit 1 in"), "{text}");
}

#[test]
fn time_running_backwards_is_placed() {
    let mut lines: Vec<String> = csv::emit(&moving(exciting, 500)).lines().map(str::to_owned).collect();
    lines.swap(100, 101);
    refused(&lines.join("\n"), "time");
}

#[test]
fn wrong_units_are_refused() {
    let with = |name: &str, change: &dyn Fn(f64) -> f64| {
        let mut log = moving(exciting, 500);
        let changed = log.column(name).expect("put in above").iter().map(|value| change(*value)).collect();
        log.replace(name, changed).expect("as long as before");
        csv::emit(&log)
    };
    refused(&with("command_1", &|u| 1000.0 + 1000.0 * u), "but 0 to 1 is expected");
    let rpm = 60.0 / std::f64::consts::TAU;
    refused(
        &with("propeller_rate_1_rad_s", &|w| rpm * w),
        "if the column is in rpm, import it with unit `rpm`",
    );
    refused(&with("battery_voltage_v", &|v| 1000.0 * v), "millivolts");
    let percent = run(&with("battery_voltage_v", &|v| 100.0 - 3.0 * (12.4 - v))).1;
    assert!(
        percent.contains("a charge in percent is no voltage") && !percent.contains("millivolts"),
        "{percent}"
    );
    refused(&with("propeller_rate_1_rad_s", &|w| -w), "import it with scale -1");
}

#[test]
fn a_rotor_that_stands_while_it_is_commanded_does_not_count_as_turned_round() {
    let mut log = moving(exciting, 500);
    // Noise about zero, a little more of it below: another rotor's commands, or a rotor that is not connected.
    let noise = |row: usize| f64::from((row.wrapping_mul(2_654_435_761) >> 24 & 255) as u8) / 64.0 - 2.1;
    log.replace("propeller_rate_1_rad_s", (0..500).map(noise).collect()).expect("as long as before");
    let text = csv::emit(&log);
    refused(&text, "the rotor stands while it is commanded");
    assert!(!run(&text).1.contains("scale -1"));
}

#[test]
fn commands_that_are_missing_are_found_as_that() {
    let text = csv::emit(&moving(exciting, 500)).replace("command_1", "throttle");
    refused(&text, "the commands are missing: it has no command_N beside its propeller_rate_N_rad_s");
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
    let sentence = "rad/s is faster than any rotor with a propeller: is the time in seconds?";
    let [slow, fast] = [log, fast].map(|log| run(&csv::emit(&log)).1);
    assert!(fast.contains(sentence), "{fast}");
    assert!(!slow.contains(sentence), "{slow}");
}

#[test]
fn without_the_battery_the_rest_is_identified_and_said_so() {
    let text = csv::emit(&moving(exciting, 3000));
    let text = text.replace("battery_voltage_v", "something_else_v");
    let (output, text) = run(&text);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("no column `battery_voltage_v`"), "{text}");
    assert!(text.contains("they hold for the charge at which the log was made"), "{text}");
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
    for (log, sentence, has_inertia) in [
        (
            degrees(&with_angle(&fast), &[rate]),
            "times the slope of the body angle: it is in degrees per second",
            false,
        ),
        (degrees(&both, &[rate, angle]), "if angle and rate are in degrees", true),
        (degrees(&fast, &[rate]), "which no body on a bench does", false),
        (degrees(&both, &[angle]), "J comes from the rate and holds", true),
        (degrees(&radians, &[rate]), "1/57 of the template's", true),
    ] {
        let (output, text) = run(&log);
        assert_eq!(output.status.code(), Some(0), "{text}");
        assert!(text.contains(sentence), "`{sentence}` is not in: {text}");
        assert_eq!(text.contains("d/J"), has_inertia, "{text}");
    }
    // Where there is nothing else, that is the end of it.
    let mut alone = Dataset::new("attitude.csv", "", both.time().to_vec()).expect("rising time");
    for name in [rate, angle] {
        alone.insert(name, both.column(name).expect("there").to_vec()).expect("as long as time");
    }
    refused(&degrees(&alone, &[rate]), "it is in degrees per second, import it with unit `deg/s`");
}
