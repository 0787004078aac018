//! One of several logs of a file, and a part of a log: chosen on the page as by the options of the commands.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Running;
use super::law::{are_open, teeth};
use crate::cancel::Cancel;
use crate::session::{self, Job, OpenConfig};
use crate::workbench::{WorkbenchConfig, saved};

fn act(it: &Running, act: &Value) -> u16 {
    it.act(&act.to_string()).status
}

/// Rows of a log as the commands read it.
fn rows(path: &Path, config: &OpenConfig) -> Value {
    let cancel = Cancel::default();
    json!(session::open(path, config, &Job::unwatched(&cancel)).expect("a log").log.raw().len())
}

/// A blackbox with two flights, one of which begins like the other and ends early.
fn blackbox(folder: &Path) -> PathBuf {
    let golden = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/formats/golden/betaflight_7_1.bbl");
    let flight = fs::read(golden).expect("a flight");
    let short = &flight[..flight.len() * 3 / 4];
    let path = folder.join("LOG.bbl");
    fs::write(&path, [short, &flight[..]].concat()).expect("written");
    path
}

#[test]
fn one_of_several_logs_is_chosen_and_named_as_by_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = blackbox(folder.path());
    let it = Running::with(std::slice::from_ref(&file));
    let desk = it.wait_for("parts", |desk| desk["logs"][0]["state"] == "parts");
    let parts = &desk["logs"][0]["parts"];
    assert_eq!((&parts[0]["part"], &parts[1]["part"]), (&json!(1), &json!(2)));
    let seconds = [0, 1].map(|at| parts[at]["seconds"].as_f64().expect("a length"));
    assert!(seconds[0] > 0.0 && seconds[0] < seconds[1], "{seconds:?}");
    assert_eq!(act(&it, &json!({ "act": "diagnose" })), 409, "none is chosen yet");
    let id = &desk["logs"][0]["id"];
    let choose = |part: u64| act(&it, &json!({ "act": "open_part", "log": id, "part": part }));
    assert_eq!((choose(3), choose(0), choose(2)), (409, 409, 200));
    let desk = it.wait_for("open", are_open);
    let log = &desk["logs"][0];
    let named = PathBuf::from(format!("{}#2", file.display()));
    assert_eq!(log["name"], json!(named));
    assert_eq!(log["rows"], rows(&named, &OpenConfig::default()));
    assert_eq!(log["others"], json!(file));
    assert_eq!(choose(1), 409, "it is chosen");
    let command = log["by_hand"].as_str().expect("a command");
    assert!(command.ends_with(&format!("--log '{}'", named.display())), "{command}");
    // The other one beside it, and both in a session.
    assert_eq!(act(&it, &json!({ "act": "open_log", "path": log["others"] })), 200);
    let desk = it.wait_for("parts", |desk| desk["logs"][1]["state"] == "parts");
    assert_eq!(act(&it, &json!({ "act": "open_part", "log": desk["logs"][1]["id"], "part": 1 })), 200);
    it.wait_for("open", are_open);
    let session = folder.path().join("session.toml");
    fs::write(&session, it.get("/api/export?what=session").body).expect("written");
    let again = Running::of(WorkbenchConfig { session: Some(session), ..WorkbenchConfig::default() });
    let desk = again.wait_for("open", are_open);
    assert_eq!(
        (&desk["logs"][0]["name"], desk["notices"].as_array().map(Vec::len)),
        (&json!(named), Some(0))
    );
}

#[test]
fn a_foreign_text_with_two_logs_is_asked_for_its_columns_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut text = "Time (s),Throttle (%)\n".to_owned();
    for row in (0..300).chain(0..200) {
        text += &format!("{},{}\n", 0.01 * f64::from(row), row % 50);
    }
    let file = folder.path().join("two.csv");
    fs::write(&file, text).expect("written");
    let it = Running::with(std::slice::from_ref(&file));
    let desk = it.wait_for("guessed", |desk| desk["logs"][0]["state"] == "guessed");
    let id = desk["logs"][0]["id"].clone();
    assert_eq!(act(&it, &json!({ "act": "confirm", "log": id })), 200);
    let desk = it.wait_for("parts", |desk| desk["logs"][0]["state"] == "parts");
    let none = Value::Null;
    assert_eq!(desk["logs"][0]["parts"][1], json!({ "part": 2, "seconds": none }));
    assert_eq!(act(&it, &json!({ "act": "open_part", "log": id, "part": 2 })), 200);
    let desk = it.wait_for("open", are_open);
    assert_eq!(desk["logs"][0]["rows"], 200);
    // Named at once, it is asked for its columns, too.
    let it = Running::with(&[PathBuf::from(format!("{}#2", file.display()))]);
    it.wait_for("guessed", |desk| desk["logs"][0]["state"] == "guessed");
}

#[test]
fn a_part_of_a_log_is_read_and_said_as_by_the_options() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = teeth(folder.path());
    let it = Running::with(&[folder.path().to_owned()]);
    let choice = json!({ "rotors": [2, 1], "from_s": 1.5, "to_s": 6.0 });
    for path in &logs {
        assert_eq!(act(&it, &json!({ "act": "open_log", "path": path, "choice": choice })), 200);
    }
    let desk = it.wait_for("open", are_open);
    let config =
        OpenConfig { rotors: vec![2, 1], from_s: Some(1.5), to_s: Some(6.0), ..OpenConfig::default() };
    assert_eq!(desk["logs"][0]["rows"], rows(&logs[0], &config));
    assert_eq!(desk["logs"][0]["choice"], choice);
    let compare = desk["logs"][0]["by_hand"].as_str().expect("a command");
    assert!(compare.contains(" --from-s 1.5 --to-s 6 --rotors 2,1 --log "), "{compare}");
    let diagnose = desk["by_hand"]["diagnose"].as_str().expect("a command");
    assert!(diagnose.contains(" --from-s 1.5 --to-s 6 --rotors 2,1 --log "), "{diagnose}");
    assert_eq!(act(&it, &json!({ "act": "identify" })), 409, "it names rotors as the log does");
    let session = it.get("/api/export?what=session").body;
    // The whole log beside a part of the other is no single command.
    assert_eq!(act(&it, &json!({ "act": "open_log", "path": logs[1] })), 200);
    let desk = it.wait_for("open", are_open);
    let held = json!({ "act": "role", "log": desk["logs"][2]["id"], "role": "held_out" });
    assert_eq!((act(&it, &held), act(&it, &json!({ "act": "diagnose" }))), (200, 409));
    let nowhere = json!({ "act": "open_log", "path": logs[0], "choice": { "from_s": 99.0 } });
    assert_eq!(act(&it, &nowhere), 200);
    let desk = it.wait_for("failed", |desk| desk["logs"][3]["state"] == "failed");
    assert!(desk["logs"][3]["why"].to_string().contains("no row from 99 s; it goes"), "{}", desk["logs"][3]);
    drop(it);
    let file = folder.path().join("session.toml");
    fs::write(&file, session).expect("written");
    assert_eq!(saved::read(&file).expect("it reads").logs[1].choice.rotors, [2, 1]);
    let again = Running::of(WorkbenchConfig { session: Some(file), ..WorkbenchConfig::default() });
    assert_eq!(again.wait_for("open", are_open)["logs"][1]["choice"], choice);
}
