//! Logs of other programs: what their columns mean is shown, mended and confirmed before anything is read, and the commands do the same.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Running;
use super::law::{are_open, teeth};
use crate::cancel::Cancel;
use crate::diagnose::DiagnoseConfig;
use crate::log::csv;
use crate::model::Model;
use crate::report::guess::mapping_file;
use crate::session::{self, Job, OpenConfig};
use crate::workbench::{WorkbenchConfig, saved};

/// A log of ours in the words and units of another program; what is called `Spin` nobody can guess.
fn foreign(log: &Path, name: &str) -> PathBuf {
    let log = csv::read(log).expect("a log");
    let columns = [
        ("ESC 1 (µs)", "command_1", 1e3, 1.0),
        ("ESC 2 (µs)", "command_2", 1e3, 1.0),
        ("Voltage (V)", "battery_voltage_v", 1.0, 0.0),
        ("Spin left", "propeller_rate_1_rad_s", 1.0, 0.0),
        ("Spin right", "propeller_rate_2_rad_s", 1.0, 0.0),
        ("body rate (deg/s)", "body_rate_rad_s", 180.0 / std::f64::consts::PI, 0.0),
        ("body angle (deg)", "body_angle_rad", 180.0 / std::f64::consts::PI, 0.0),
    ];
    let heads: Vec<&str> = columns.iter().map(|(head, ..)| *head).collect();
    let mut text = format!("Time (s),{}\n", heads.join(","));
    for (row, time) in log.time().iter().enumerate() {
        let _ = write!(text, "{time}");
        for (_, signal, scale, offset) in columns {
            let value = log.column(signal).map_or(f64::NAN, |values| values[row]);
            let _ = match value.is_nan() {
                true => write!(text, ","),
                false => write!(text, ",{}", (value + offset) * scale),
            };
        }
        text.push('\n');
    }
    let path = log_beside(name, log.source_name());
    fs::write(&path, text).expect("written");
    path
}

fn log_beside(name: &str, log: &str) -> PathBuf {
    Path::new(log).parent().unwrap_or(Path::new("")).join(name)
}

const MENDED: [(&str, &str); 2] =
    [("Spin left", "propeller_rate_1_rad_s"), ("Spin right", "propeller_rate_2_rad_s")];

fn state(desk: &Value, log: usize) -> &str {
    desk["logs"][log]["state"].as_str().unwrap_or_default()
}

fn act(it: &Running, act: &Value) -> u16 {
    it.act(&act.to_string()).status
}

#[test]
fn foreign_columns_are_mended_confirmed_and_read_as_by_the_commands() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = teeth(folder.path());
    let logs = [foreign(&own[0], "stand.csv"), foreign(&own[1], "stand_2.csv")];
    let it = Running::with(&logs);
    let desk = it.wait_for("guessed", |desk| state(desk, 0) == "guessed" && state(desk, 1) == "guessed");
    let ids = [0, 1].map(|log| desk["logs"][log]["id"].clone());
    let columns = desk["logs"][0]["guess"]["columns"].as_array().expect("columns");
    let spin = columns.iter().find(|it| it["column"] == "Spin left").expect("a column");
    assert_eq!((&spin["certainty"], spin["samples"].as_array().map(Vec::len)), (&json!("unknown"), Some(5)));
    assert_eq!(act(&it, &json!({ "act": "diagnose" })), 409, "nothing is fitted on a guess");
    let mend = |column: &str, signal: &str, unit: &str| {
        act(&it, &json!({ "act": "mend", "log": ids[0], "column": column, "signal": signal, "unit": unit }))
    };
    assert_eq!(mend("Spin left", "propeller_rate_1_rad_s", "V"), 409, "a rate is not in volts");
    for (column, signal) in MENDED {
        assert_eq!(mend(column, signal, "rad/s"), 200, "{column}");
    }
    let desk = it.json("/api/desk");
    assert_eq!(state(&desk, 0), "guessed", "mended is not yet confirmed");
    assert_eq!(act(&it, &json!({ "act": "confirm", "log": ids[0] })), 200);
    let desk = it.wait_for("open", |desk| state(desk, 0) == "open");
    assert_eq!((state(&desk, 1), &desk["logs"][0]["mapping"]), ("guessed", &json!("stand.toml")));
    let command = desk["done"].as_array().and_then(|done| done.last()).expect("a command");
    let command = command.as_str().expect("text");
    let mended = "--column 'Spin left=propeller_rate_1_rad_s:rad/s' --column 'Spin right=propeller_rate_2_rad_s:rad/s'";
    assert!(command.contains(" --write-mapping stand.toml ") && command.ends_with(mended), "{command}");

    // The mapping file is the command's, byte for byte.
    let cancel = Cancel::default();
    let job = Job::unwatched(&cancel);
    let mut guessed = session::guess_columns(&logs[0], &job).expect("read").expect("a guess");
    for (column, signal) in MENDED {
        guessed.mend(column, signal, Some("rad/s")).expect("mended");
    }
    let text = mapping_file(&guessed, &logs[0].display().to_string()).expect("text");
    let saved = it.get(&format!("/api/export?what=mapping&id={}", ids[0]));
    assert!(saved.head.contains("filename=\"stand.toml\""), "{}", saved.head);
    assert_eq!(saved.body, text);

    // The other log has the same columns; one mapping is for both.
    assert_eq!(desk["logs"][1]["guess"]["like"], json!(["stand.toml"]));
    assert_eq!(act(&it, &json!({ "act": "confirm", "log": ids[1], "like": "gone.toml" })), 409);
    assert_eq!(act(&it, &json!({ "act": "confirm", "log": ids[1], "like": "stand.toml" })), 200);
    let desk = it.wait_for("open", are_open);
    let shown = desk["by_hand"]["diagnose"].as_str().expect("a command");
    assert!(shown.contains(" --mapping stand.toml --log "), "{shown}");
    assert_eq!(act(&it, &json!({ "act": "add", "effects": ["torque_bias"] })), 200);
    it.wait_for("added", |desk| desk["models"].as_array().is_some_and(|all| all.len() == 2));
    let file = folder.path().join("stand.toml");
    fs::write(&file, &text).expect("written");
    let config = OpenConfig { mapping: Some(file.display().to_string()), ..OpenConfig::default() };
    let [fit, held_out] = [0, 1]
        .map(|log: usize| session::open_all(&logs[log..=log], &config, &job).expect("it opens by the file"));
    let effects = ["torque_bias".to_owned()];
    let config = DiagnoseConfig::default();
    let by_hand =
        session::extend(&Model::paper(), &effects, (&fit, &held_out), &config, &job).expect("fitted");
    let mut expected = by_hand.extension.model;
    expected.name = "step-1".to_owned();
    assert_eq!(it.get("/api/export?what=model").body, expected.emit().expect("text"), "byte for byte");
    opens_again(&it, folder.path());
}

/// A session remembers what the columns mean; a log of ours beside another mapping is one command, two mappings are none.
fn opens_again(it: &Running, folder: &Path) {
    let file = folder.join("session.toml");
    fs::write(&file, it.get("/api/export?what=session").body).expect("written");
    assert!(saved::read(&file).expect("it reads").logs.iter().all(|log| log.mapping.is_some()));
    let again = Running::of(WorkbenchConfig { session: Some(file), ..WorkbenchConfig::default() });
    let desk = again.wait_for("open", are_open);
    assert_eq!(desk["logs"][1]["mapping"], "stand.toml");
    let [first, second] = [0, 1].map(|log| desk["logs"][log]["id"].clone());
    let own = json!({ "act": "open_log", "path": folder.join("held_out.csv") });
    assert_eq!(act(&again, &own), 409, "a folder that was not named");
    // Its columns are asked for again, and said otherwise.
    assert_eq!(act(&again, &json!({ "act": "ask_again", "log": second })), 200);
    again.wait_for("guessed", |desk| state(desk, 1) == "guessed");
    assert_eq!(act(&again, &json!({ "act": "confirm", "log": second })), 200);
    let desk = again.wait_for("open", are_open);
    assert_eq!(desk["logs"][1]["mapping"], "stand_2.toml");
    assert_eq!(act(&again, &json!({ "act": "diagnose" })), 409, "two mappings in one command");
    // Said as those of the first, they are read by its mapping: one command reads both.
    assert_eq!(act(&again, &json!({ "act": "ask_again", "log": second })), 200);
    again.wait_for("guessed", |desk| state(desk, 1) == "guessed");
    for (column, signal) in MENDED {
        let mend =
            json!({ "act": "mend", "log": second, "column": column, "signal": signal, "unit": "rad/s" });
        assert_eq!(act(&again, &mend), 200);
    }
    let done = again.json("/api/desk")["done"].clone();
    assert_eq!(act(&again, &json!({ "act": "confirm", "log": second })), 200);
    let desk = again.wait_for("open", are_open);
    assert_eq!((&desk["logs"][1]["mapping"], &desk["done"]), (&json!("stand.toml"), &done));
    assert!(
        desk["by_hand"]["diagnose"].as_str().is_some_and(|it| it.contains(" --mapping stand.toml --log "))
    );
    assert_eq!(act(&again, &json!({ "act": "role", "log": first, "role": "look" })), 200);
    assert_eq!(act(&again, &json!({ "act": "role", "log": second, "role": "fit" })), 200);
    assert_eq!(act(&again, &json!({ "act": "recalibrate" })), 200);
}
