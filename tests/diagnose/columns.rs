//! Columns in another unit than their name says, and of another rotor: fitted, they would be reported as physics.

use super::desk::{Desk, diagnose, finding, number, refused, run, said_out};

const DEGREES: f64 = 180.0 / std::f64::consts::PI;
const RPM: f64 = 30.0 / std::f64::consts::PI;

/// The command's words, each a cell of its own.
fn of(log: &std::path::Path, command: &str) -> Vec<String> {
    command.split(' ').map(|word| word.replace("LOG", &log.display().to_string())).collect()
}

#[test]
fn a_column_in_another_unit_is_refused_with_the_unit_to_import_it_with() {
    let desk = Desk::new();
    let recorded = desk.record("recorded.csv", 1, &[]);
    let cases: [(&str, f64, &[&str]); 10] = [
        ("command", 100.0, &["percent: scale 0.01"]),
        (
            "propeller_rate",
            RPM,
            &["times what the model's rotor does", "unit `rpm`", "if it is another rotor"],
        ),
        (
            "propeller_rate",
            0.5 / std::f64::consts::PI,
            &["times what the model's rotor does", "unit `rev/s`"],
        ),
        ("propeller_rate", -1.0, &["rates are negative", "scale -1"]),
        ("battery_voltage", 1000.0, &["unit `mV`"]),
        ("battery_voltage", 10.0, &["tenths of a volt: scale 0.1"]),
        ("battery_voltage", 100.0, &["hundredths of a volt: scale 0.01"]),
        ("body_rate", DEGREES, &["times the slope of the body angle", "unit `deg/s`"]),
        ("body_angle", DEGREES, &["times the body rate", "unit `deg`"]),
        ("time", 1e3, &["milliseconds", "unit `ms`"]),
    ];
    for (stem, factor, parts) in cases {
        let scaled = |name: &str, value: f64| if name.starts_with(stem) { factor * value } else { value };
        let log = desk.changed(&recorded, "scaled.csv", f64::INFINITY, |_| true, scaled);
        let parts = [&["scaled.csv"][..], parts].concat();
        let words = of(&log, "diagnose --log LOG");
        refused(&words.iter().map(String::as_str).collect::<Vec<_>>(), &parts);
        // `compare` reports the same.
        let words = of(&log, "compare --log LOG");
        let seen = said_out(&run(&words.iter().map(String::as_str).collect::<Vec<_>>()));
        let seen = seen.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in &parts {
            assert!(seen.contains(part), "`{part}` is not in: {seen}");
        }
    }
    // A battery that is not connected is none: the logs are taken as if it had not been read, by all commands alike.
    let empty = |name: &str, value: f64| if name == "battery_voltage_v" { 0.0 } else { value };
    let log = desk.changed(&recorded, "scaled.csv", f64::INFINITY, |_| true, empty);
    for command in ["diagnose --log LOG", "compare --log LOG"] {
        let words = of(&log, command);
        let seen = said_out(&run(&words.iter().map(String::as_str).collect::<Vec<_>>()));
        let seen = seen.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in ["which no battery has that turns a rotor", "as if no voltage had been measured"] {
            assert!(seen.contains(part), "`{part}` is not in: {seen}");
        }
    }
    let model = desk.path("better.toml");
    let exchanged = std::fs::read_to_string(&recorded).expect("a log");
    let exchanged = exchanged.replacen("command_1,command_2", "command_2,command_1", 1);
    let log = desk.write("exchanged.csv", &exchanged).display().to_string();
    let path = model.display().to_string();
    let extend = ["extend", "--effect", "torque_bias", "--log", &log, "-o", &path];
    for command in [&["diagnose", "--log", &log][..], &extend] {
        refused(command, &["exchanged.csv", "slows down when it is commanded more", "another rotor"]);
    }
    assert!(!model.exists(), "a model file after a refusal");
}

/// Both in degrees is a body that is 57 times as light: it may be one, and the unit is asked for first.
#[test]
fn a_body_that_is_57_times_as_light_is_asked_for_its_unit_before_its_inertia_is_taken_over() {
    let desk = Desk::new();
    let scaled = |name: &str, value: f64| if name.starts_with("body_") { DEGREES * value } else { value };
    let [train, held_out] = [("train.csv", 1), ("held-out.csv", 2)].map(|(name, sequence)| {
        let recorded = desk.record(&format!("recorded-{name}"), sequence, &[]);
        desk.changed(&recorded, name, f64::INFINITY, |_| true, scaled).display().to_string()
    });
    let story = said_out(&run(&["diagnose", "--log", &train, "--validate", &held_out]));
    // The unit to import it with, and the command that takes the inertia over.
    let [unit, taken_over] = ["deg/s", "rotorbench extend"].map(|it| story.find(it));
    assert!(unit.is_some() && taken_over.is_some() && unit < taken_over, "{story}");
    assert!(story[taken_over.unwrap_or(0)..].contains("--recalibrate"), "{story}");
}

/// Zeros of a telemetry that drops out are no battery: a diagnosis without them is the one with.
#[test]
fn zeros_of_the_battery_are_missing_cells_and_told() {
    let desk = Desk::new();
    let bench_logs = [("train.csv", 1), ("held-out.csv", 2)].map(|(name, sequence)| {
        let recorded =
            desk.record(&format!("recorded-{name}"), sequence, &["--hide", "transport_delay:delay=0.03"]);
        let row = std::cell::Cell::new(0);
        let dropped = |name: &str, value: f64| {
            row.set(row.get() + u32::from(name == "time_s"));
            if name == "battery_voltage_v" && row.get().is_multiple_of(40) { 0.0 } else { value }
        };
        (desk.changed(&recorded, name, f64::INFINITY, |_| true, dropped), recorded)
    });
    let [(train, full), (held_out, full_held_out)] = &bench_logs;
    let (answer, _) = diagnose("paper", train, held_out);
    let (expected, _) = diagnose("paper", full, full_held_out);
    assert_eq!(answer["effects"], expected["effects"], "{answer:#}");
    assert_eq!(answer["effects"], serde_json::json!(["transport_delay"]), "{answer:#}");
    let error = |answer| number(answer, &["error", "extended", "validate"]);
    // The last reading stands in for a missing one: 0.01 V, 0.4 rad/s, in one row of 40.
    assert!((error(&answer) / error(&expected) - 1.0).abs() < 0.02, "{answer:#}");
    let dropout = finding(&answer, "battery_dropout");
    assert_eq!(dropout["rows"], 25, "{dropout}");
    let findings = said_out(&run(&[
        "import",
        &train.display().to_string(),
        "-o",
        &desk.path("i.csv").display().to_string(),
        "--json",
    ]));
    assert!(findings.contains("\"battery_dropout\""), "{findings}");
}

/// What was not tried is no evidence of absence: the terminal says so.
#[test]
fn effects_that_were_not_tried_are_told_with_what_they_need() {
    let desk = Desk::new();
    let [train, held_out] = [("train.csv", 1), ("held-out.csv", 2)].map(|(name, sequence)| {
        let recorded = desk.record(&format!("recorded-{name}"), sequence, &[]);
        desk.changed(&recorded, name, f64::INFINITY, |column| column != "body_angle_rad", |_, value| value)
    });
    let (answer, _) = diagnose("paper", &train, &held_out);
    let is_lacking = |it: &&serde_json::Value| it["refusal"]["code"] == "column_lacking";
    let lacking: Vec<&serde_json::Value> =
        answer["candidates"].as_array().into_iter().flatten().filter(is_lacking).collect();
    for effect in ["gravity_pendulum", "cable_stiffness"] {
        let refused = lacking.iter().find(|it| it["effect"] == effect);
        let column = refused.map(|it| &it["refusal"]["column"]);
        assert_eq!(
            column.and_then(serde_json::Value::as_str),
            Some("body_angle_rad"),
            "{effect}: {lacking:?}"
        );
    }
    let [train, held_out] = [train, held_out].map(|log| log.display().to_string());
    let story = said_out(&run(&["diagnose", "--log", &train, "--validate", &held_out]));
    for effect in lacking.iter().filter_map(|it| it["effect"].as_str()) {
        assert!(story.contains(effect), "{effect}: {story}");
    }
    // They have more than one reason: a short answer has no room for them.
    assert!(!story.contains("`body_angle_rad`"), "{story}");
    let whole = said_out(&run(&["diagnose", "--log", &train, "--validate", &held_out, "--notes"]));
    assert!(whole.contains("`body_angle_rad`"), "{whole}");
}
