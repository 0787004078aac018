//! Logs whose readings repeat, or are outliers here and there, get the answer that they would get without.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::desk::{Desk, diagnose, finding, has_code, number, refused, run, said, said_out};

/// What is measured, by the beginning of the column's name.
const MEASURED: [&str; 2] = ["propeller_rate", "body_"];

/// The log with its measured cells changed: `change` gets the row, the column's number, the cell and the cell above.
fn changed(log: &Path, name: &str, change: impl Fn(usize, usize, f64, f64) -> f64) -> PathBuf {
    let text = fs::read_to_string(log).expect("a log");
    let mut lines = text.lines();
    let header = lines.next().expect("a header");
    let columns: Vec<bool> =
        header.split(',').map(|name| MEASURED.iter().any(|it| name.starts_with(it))).collect();
    let mut above = vec![f64::NAN; columns.len()];
    let mut out = format!("{header}\n");
    for (row, line) in lines.enumerate() {
        let cells = line.split(',').enumerate().map(|(column, cell)| match cell.parse::<f64>() {
            Ok(value) if columns[column] => {
                above[column] = change(row, column, value, above[column]);
                above[column].to_string()
            }
            _ => cell.to_owned(),
        });
        out += &(cells.collect::<Vec<_>>().join(",") + "\n");
    }
    let path = log.with_file_name(name);
    fs::write(&path, out).expect("written");
    path
}

fn held(log: &Path, name: &str) -> PathBuf {
    changed(log, name, |row, _, cell, above| if row % 2 == 0 { cell } else { above })
}

/// One cell in 200, each column's own, is ten times what it should be, and more.
fn with_outliers(log: &Path, name: &str) -> PathBuf {
    let is_one = |row: usize, column: usize| (row * 7919 + column * 104_729).is_multiple_of(199) && row > 20;
    changed(log, name, |row, column, cell, _| if is_one(row, column) { 10.0 * cell + 20.0 } else { cell })
}

/// `compare` finds the paper's own bench at its noise, with a rotor's reading held or with outliers.
#[test]
fn compare_takes_such_readings_as_missing() {
    let desk = Desk::new();
    let log = desk.path("rotor.csv");
    let recorded =
        run(&["experiment", "prbs", "--lockstep", "--duration", "60", "-o", &log.display().to_string()]);
    assert!(recorded.status.success());
    for log in [held(&log, "held.csv"), with_outliers(&log, "outliers.csv")] {
        let output = run(&["compare", "--log", &log.display().to_string(), "--json"]);
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let comparison = &answer["comparisons"][0];
        assert!(!comparison["warnings"].as_array().expect("a list").is_empty(), "{comparison:#}");
        let block =
            comparison["blocks"].as_array().expect("blocks").iter().find(|it| it["name"] == "actuator_1");
        let block = block.expect("the rotor's own block");
        // The sensor's noise, 1.5 rad/s.
        let rms = number(block, &["error", "rms"]);
        assert!((1.35..1.65).contains(&rms), "{rms}");
        assert!(
            number(block, &["error", "noise_floor"]) > 1.2 && block["failure"]["spectrum"].is_object(),
            "{block:#}"
        );
        let text = said_out(&run(&["import", &log.display().to_string()]));
        assert!(text.contains("no measurements"), "{text}");
    }
}

/// A log whose rates are read in every 12th row only: 4.2 Hz, as PX4 logs its ESCs.
fn seldom_read(desk: &Desk, log: &Path, name: &str) -> PathBuf {
    let text = fs::read_to_string(log).expect("a log");
    let names: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
    let wanted = ["time_s", "command_1", "command_2", "battery_voltage_v"];
    let line = |(row, line): (usize, &str)| {
        let cells = names.iter().zip(line.split(',')).filter_map(|(name, cell)| {
            let is_rate = name.starts_with("propeller_rate");
            let is_read = row == 0 || row % 12 == 1;
            (wanted.contains(name) || is_rate).then_some(if is_rate && !is_read { "" } else { cell })
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    desk.write(name, &text.lines().enumerate().map(line).collect::<String>())
}

#[test]
fn telemetry_at_a_few_hertz_gets_no_pole_and_no_delay() {
    let desk = Desk::new();
    let log = |name: &str, seed: u32| {
        let more = ["--hide", "transport_delay:delay=0.06"];
        seldom_read(&desk, &desk.record(&format!("{name}_all.csv"), seed, &more), name)
    };
    let (train, held_out) = (log("train.csv", 1), log("held_out.csv", 2));
    let (answer, _) = diagnose("paper", &train, &held_out);
    let found = finding(&answer, "readings_too_seldom");
    assert!((number(found, &["evidence", "rate_hz"]) - 50.0 / 12.0).abs() < 0.01, "{found}");
    assert_eq!(found["evidence"]["needed_hz"], 6.4, "2.5 time constants of p = 16");
    assert_eq!(
        (&answer["verdict"], &answer["effects"]),
        (&"insufficient_data".into(), &serde_json::json!([]))
    );
    assert_eq!(answer["changed_parameters"], serde_json::json!([]), "no pole, either");
    let all = answer["candidates"].as_array().expect("a list");
    let delay = all.iter().find(|it| it["effect"] == "transport_delay").expect("it is refused");
    assert_eq!(delay["refusal"]["code"], "readings_too_seldom");
    let train = train.display().to_string();
    let compared = run(&["compare", "--log", &train, "--json"]);
    let compared: Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    assert!(has_code(&compared["comparisons"][0], "readings_too_seldom"));
    // It has no ramps and no levels: nothing can be identified, and the reason is said.
    refused(&["identify", "--log", &train], &["rates come at 4.2 Hz"]);

    let ramps = desk.path("ramps_all.csv");
    let output = run(&["experiment", "ramp", "--lockstep", "-o", &ramps.display().to_string()]);
    assert!(output.status.success(), "{}", said(&output));
    let ramps = seldom_read(&desk, &ramps, "ramps.csv").display().to_string();
    let found = run(&["identify", "--log", &ramps, &train, "--json"]);
    let found: Value = serde_json::from_slice(&found.stdout).expect("JSON");
    assert!(has_code(&found, "readings_too_seldom") && has_code(&found, "pole_from_template"), "{found}");
    // The emulator's curve, within 1 %: the rates are read with 1.5 rad/s of noise, at 4 Hz.
    let steady = |u: f64| {
        let powers = found["actuator"]["coefficients"].as_array().expect("a list").iter().zip(1..);
        powers.map(|(c, power)| c.as_f64().expect("a number") * u.powi(power)).sum::<f64>()
    };
    let truth = |u: f64| 1124.5 * u + 447.1 * u * u;
    assert!([0.35, 0.5].iter().all(|u| (steady(*u) / truth(*u) - 1.0).abs() < 0.01), "{found}");
}

/// Of a body that is held while both thrusts are equal nothing can be explained: its gyro reads noise, and that is no share of anything.
#[test]
fn a_signal_that_is_noise_only_has_no_shares() {
    let desk = Desk::new();
    let log = desk.path("both.csv").display().to_string();
    let recorded =
        run(&["experiment", "prbs", "--rotors", "both", "--lockstep", "--duration", "30", "-o", &log]);
    assert!(recorded.status.success(), "{}", said(&recorded));
    let compared = run(&["compare", "--log", &log, "--json"]);
    assert_eq!(compared.status.code(), Some(0), "{}", said(&compared));
    let compared: Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    let blocks = compared["comparisons"][0]["blocks"].as_array().expect("blocks");
    let shares = |block: &Value| ["fit_percent", "explained", "noise"].map(|it| block["error"][it].as_f64());
    let of = |signal: &str| blocks.iter().filter(|it| it["signal"] == signal).map(shares).collect::<Vec<_>>();
    let body = of("body_rate_rad_s");
    assert!(body.len() >= 2 && body.iter().all(|it| *it == [None; 3]), "{body:?}");
    let rotor = of("propeller_rate_1_rad_s");
    assert!(rotor.iter().flatten().all(|it| it.is_some_and(|share| share > 0.0)), "{rotor:?}");
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    #[test]
    fn readings_that_repeat_or_are_outliers_do_not_change_the_answer() {
        let desk = Desk::new();
        let hidden = [
            (vec![], "adequate", None),
            (
                vec!["--hide", "gravity_pendulum:moment=0.3"],
                "missing_effect",
                Some(("gravity_pendulum", "moment", 0.3)),
            ),
        ];
        for (number_of, (hide, verdict, effect)) in hidden.into_iter().enumerate() {
            let named = |name: &str| format!("{name}_{number_of}.csv");
            let record = |name: &str, seed| desk.record(&named(name), seed, &hide);
            let (train, held_out) = (record("train", 1), record("held_out", 2));
            let held = [held(&train, "held_train.csv"), held(&held_out, "held_held_out.csv")];
            let outliers = [with_outliers(&train, "o_train.csv"), with_outliers(&held_out, "o_held_out.csv")];
            for ([train, held_out], code) in [(held, "sample_and_hold"), (outliers, "outliers")] {
                let (answer, _) = diagnose("paper", &train, &held_out);
                assert_eq!(answer["verdict"], verdict, "{hide:?}, {code}: {answer:#}");
                let findings = answer["findings"].as_array().expect("findings");
                assert!(findings.iter().any(|it| it["code"] == code), "{:#}", answer["findings"]);
                let Some((effect, parameter, truth)) = effect else { continue };
                assert_eq!(answer["effects"], serde_json::json!([effect]), "{code}: {}", answer["ladder"]);
                let found = &answer["parameters"][&format!("{effect}.{parameter}")];
                let off = (number(found, &["value"]) - truth).abs();
                // The promise that logs without such cells have, too.
                assert!(
                    off < 0.1 * truth || off < 3.0 * number(found, &["standard_error"]),
                    "{code}: {found}"
                );
            }
        }
    }
}
