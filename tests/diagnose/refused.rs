//! What `diagnose`, `extend` and `compare` refuse, and in which words.

use std::fs;
use std::process::Command;

use super::desk::{Desk, diagnose, has_code, refused, run, said};

#[test]
fn logs_that_cannot_tell_are_said_to_be_such() {
    let desk = Desk::new();
    let rows = |count: usize, command: f64| -> String {
        let row =
            |index: usize| format!("{},{command},12.6,{}\n", 0.02 * index as f64, 617.0 + (index % 7) as f64);
        let head = "time_s,command_1,battery_voltage_v,propeller_rate_1_rad_s\n".to_owned();
        head + &(0..count).map(row).collect::<String>()
    };
    for (name, count) in [("constant.csv", 2000), ("ten.csv", 10)] {
        let log = desk.write(name, &rows(count, 0.4633));
        let (answer, code) = diagnose("paper", &log, &log);
        assert_eq!((&answer["verdict"], code), (&"insufficient_data".into(), Some(1)), "{name}");
        assert_eq!(answer["effects"], serde_json::json!([]), "{name}");
        assert!(
            answer["warnings"].as_array().is_some_and(|said| !said.is_empty()),
            "{name}: no reason given"
        );
    }
    // Two rotors that stand at different commands have not moved either, nor has the body between them.
    let row = |index: usize| {
        let [one, other, rate] = [7, 11, 13].map(|modulus| (index * index % modulus) as f64);
        let (rotors, body) = (format!("{},{}", 617.0 + one, 660.0 + other), 1e-3 * rate);
        format!("{},0.44,0.49,12.5,{rotors},{body},{}\n", 0.01 * index as f64, 1e-4 * one)
    };
    let head = "time_s,command_1,command_2,battery_voltage_v,propeller_rate_1_rad_s,propeller_rate_2_rad_s,\
                body_rate_rad_s,body_angle_rad\n";
    let log = desk.write("two.csv", &(head.to_owned() + &(0..2000).map(row).collect::<String>()));
    let (answer, code) = diagnose("paper", &log, &log);
    assert_eq!((&answer["verdict"], code), (&"insufficient_data".into(), Some(1)), "{answer:#}");
    let log =
        desk.write("voltage.csv", "time_s,battery_voltage_v\n0,12.6\n0.02,12.6\n").display().to_string();
    refused(&["diagnose", "--log", &log], &["voltage.csv", "nothing to compare", "command_1"]);
}

#[test]
fn extend_refuses_what_it_cannot_fit_and_writes_nothing() {
    let desk = Desk::new();
    let rows: String = (0..10).map(|row| format!("{},0.4633,12.6,617\n", 0.02 * f64::from(row))).collect();
    let text = format!("time_s,command_1,battery_voltage_v,propeller_rate_1_rad_s\n{rows}");
    let log = desk.write("ten.csv", &text).display().to_string();
    let model = desk.path("better.toml");
    let path = model.display().to_string();
    let extend = |effects: &[&str], more: &[&str], parts: &[&str]| {
        let arguments = [&["extend", "--log", &log, "-o", &path, "--effect"][..], effects, more].concat();
        refused(&arguments, parts);
        assert!(!model.exists(), "a model file after a refusal");
    };
    extend(&["transport_delay"], &[], &["transport_delay", "10 samples are too few"]);
    extend(&["transport_delay", "transport_delay"], &[], &["transport_delay", "twice"]);
    for horizon in ["0", "-1", "nan", "soon"] {
        extend(&["transport_delay"], &[&format!("--horizon-s={horizon}")], &["--horizon-s"]);
    }
}

/// Before the work whose result it is for, not after: there is no log to be read here.
#[test]
fn a_result_that_could_not_be_written_is_refused_at_once() {
    let desk = Desk::new();
    let nowhere = desk.path("no-such-folder/out").display().to_string();
    let folder = desk.path("").display().to_string();
    for place in [nowhere.as_str(), &folder] {
        for command in [
            ["extend", "--effect", "torque_bias", "--log", "none.csv", "-o", place].as_slice(),
            &["diagnose", "--log", "none.csv", "--report", place],
            &["compare", "--log", "none.csv", "--report", place],
            &["compare", "--log", "none.csv", "--signals", place],
            &["identify", "--log", "none.csv", "-o", place],
            &["identify", "--log", "none.csv", "--report", place],
        ] {
            refused(command, &[place]);
        }
    }
    assert_eq!(fs::read_dir(desk.path("")).expect("a folder").count(), 0, "and nothing is left there");
}

#[test]
fn logs_of_two_benches_are_refused() {
    let desk = Desk::new();
    let one = desk.record("one.csv", 1, &[]).display().to_string();
    // The other bench: three times the inertia. Its model file is the paper's with one number changed.
    let paper = desk.path("paper.toml").display().to_string();
    let arguments = ["extend", "--model", "paper", "--effect", "torque_bias", "--log", &one, "-o", &paper];
    assert_eq!(run(&arguments).status.code(), Some(1));
    let text = fs::read_to_string(&paper).expect("a model file");
    let heavy: String =
        text.lines()
            .map(|line| {
                if line.starts_with("inertia = ") && !line.contains("e-") { "inertia = 0.096" } else { line }
            })
            .map(|line| format!("{line}\n"))
            .collect();
    let heavy = desk.write("heavy.toml", &heavy).display().to_string();
    let other = desk.record("other.csv", 2, &["--model", &heavy]).display().to_string();
    refused(
        &["diagnose", "--log", &one, &other],
        &["one.csv", "other.csv", "not of one bench", "inertia", "diagnose each by itself"],
    );
    let taken = desk.path("taken.toml");
    let path = taken.display().to_string();
    for added in [&["--recalibrate"][..], &["--effect", "gravity_pendulum"]] {
        let arguments = [&["extend", "-o", &path, "--log", &one, &other][..], added].concat();
        refused(&arguments, &["one.csv", "other.csv", "not of one bench"]);
    }
    assert!(!taken.exists(), "a model of two benches");
}

#[test]
fn a_model_that_cannot_be_used_is_refused_with_its_place() {
    let desk = Desk::new();
    let log = desk.record("log.csv", 1, &[]).display().to_string();
    let model = |body: &str| {
        let head = "name = \"mine\"\n[actuator]\nsteady_rate = [0.0, 1124.5, 447.1]\nvoltage_gain = 40.0\n\
                    full_voltage = 12.6\npole = 16.0\nthrust_coefficient = 1.6e-5\nhover_rate = 617.0\n\
                    [body]\ninertia = 0.032\narm = 0.25\n";
        desk.write("model.toml", &format!("{head}{body}")).display().to_string()
    };
    let unknown = model("[[effects]]\nid = \"perpetual_motion\"\nparameters = { }\n");
    refused(&["diagnose", "--model", &unknown, "--log", &log], &["model.toml", "perpetual_motion"]);
    let own = |expression: &str| {
        format!(
            "[[user_effects]]\nid = \"mine\"\nsite = \"torque\"\nexpression = \"{expression}\"\n\
             [[user_effects.parameters]]\nname = \"k\"\nunit = \"N m\"\nstart = 0.01\nlower = 0.0\nupper = 1.0\n"
        )
    };
    let typo = model(&own("-k*bodyrate"));
    refused(&["diagnose", "--model", &typo, "--log", &log], &["model.toml", "bodyrate"]);
    let divides = model(&own("-k/(body_angle-body_angle)"));
    refused(&["diagnose", "--model", &divides, "--log", &log], &["mine", "not a number", "log.csv"]);
}

#[test]
fn logs_that_no_model_can_be_held_against_are_refused_in_a_sentence() {
    let desk = Desk::new();
    let rows = |line: &dyn Fn(usize) -> String| (0..300).map(line).collect::<String>();
    let foreign = format!("time_s,foo,command_1\n{}", rows(&|row| format!("{},1,\n", 0.01 * row as f64)));
    let foreign = desk.write("foreign.csv", &foreign).display().to_string();
    for command in ["compare", "diagnose"] {
        refused(
            &[command, "--log", &foreign],
            &["foreign.csv holds `foo`, `command_1` (without a value)", "propeller_rate_1_rad_s"],
        );
    }
    let huge = format!(
        "time_s,command_1,propeller_rate_1_rad_s\n{}",
        rows(&|row| format!("{},{},1e160\n", 0.01 * row as f64, 0.4 + 0.2 * (row / 50 % 2) as f64))
    );
    let huge = desk.write("huge.csv", &huge).display().to_string();
    for command in ["compare", "diagnose", "identify"] {
        refused(&[command, "--log", &huge], &["huge.csv", "`propeller_rate_1_rad_s` is 1e160", "0 s"]);
    }
    for horizon in ["0", "-1", "1e9", "nan", "inf"] {
        let option = format!("--horizon-s={horizon}");
        refused(&["compare", "--log", &foreign, &option], &["--horizon-s", "must lie in"]);
        refused(&["diagnose", "--log", &foreign, &option], &["--horizon-s", "must lie in"]);
    }
}

/// `rotorbench effects | head -1` ends quietly.
#[test]
fn a_reader_who_has_gone_ends_a_command_that_computes_without_a_panic() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .arg("effects")
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(said(&output), "");
}

#[test]
fn a_disk_that_is_full_behind_standard_output_is_told() {
    for command in ["effects", "check"] {
        let full = fs::File::options().write(true).open("/dev/full").expect("Linux has it");
        let output = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
            .arg(command)
            .stdout(full)
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(said(&output), "error: standard output: No space left on device\n");
    }
}

#[test]
fn a_name_that_no_bench_can_have_is_refused_by_whoever_reads_it() {
    let desk = Desk::new();
    for name in ["a/b", ""] {
        let file = desk.write("bench.toml", &format!("name = \"{name}\"\n")).display().to_string();
        refused(
            &["check", "--config", &file],
            &["bench.toml, line 1", "cannot name a bench", "1 to 32 letters"],
        );
    }
}

/// A rate that was not measured asks for numbers that no bench has, and a missing effect for numbers that make up for it.
#[test]
fn numbers_that_no_bench_has_or_that_make_up_for_an_effect_are_not_just_taken_over() {
    let desk = Desk::new();
    let bench_log = desk.record("log.csv", 1, &[]);
    let text = fs::read_to_string(&bench_log).expect("a log");
    let header: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
    let at = header.iter().position(|name| *name == "propeller_rate_2_rad_s").expect("measured");
    let reading = |name: &str, cell: fn(usize) -> &'static str| {
        let read = |(row, line): (usize, &str)| {
            let mut cells: Vec<&str> = line.split(',').collect();
            if row > 0 {
                cells[at] = cell(row);
            }
            cells.join(",") + "\n"
        };
        desk.write(name, &text.lines().enumerate().map(read).collect::<String>()).display().to_string()
    };
    let output = desk.path("own.toml").display().to_string();
    let take_over = ["extend", "--recalibrate", "-o", &output, "--log"];
    // Zeros were not measured; the noise of a sensor that sees nothing is not known from a rate.
    let zeros = reading("zeros.csv", |_| "0");
    let output = run(&[&take_over[..], &[&zeros, "--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "nothing to change, and only noise is left: {}", said(&output));
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(has_code(&answer, "nothing_to_change"), "{answer}");
    assert_eq!(answer["findings"][0]["code"], "nothing_to_change", "it comes first: {answer}");
    let why = answer["findings"].as_array().is_some_and(|findings| findings.len() > 1);
    assert!(why, "that rotor 2 reads zero is said: {answer}");
    let noise = reading("noise.csv", |row| ["3", "5", "4"][row % 3]);
    refused(&[&take_over[..], &[&noise]].concat(), &["nothing to take over", "would go from"]);
    assert!(!desk.path("own.toml").exists());

    let log =
        desk.record("pendulum.csv", 1, &["--hide", "gravity_pendulum:moment=0.3"]).display().to_string();
    let output = run(&[&take_over[..], &[&log, "--json"]].concat());
    assert_eq!(output.status.code(), Some(1), "something is missing: {}", said(&output));
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(has_code(&answer, "refitted_above_noise_floor"), "{answer}");
}
