//! The whole circle through the server: the error, what is missing, added, stepped back; the same numbers and the same files as
//! the functions that the commands call give.

use std::fs;
use std::path::PathBuf;

use serde_json::{Value, json};

use super::client::Running;
use crate::cancel::Cancel;
use crate::diagnose::DiagnoseConfig;
use crate::log::csv;
use crate::model::Model;
use crate::screening::ScreenedLog;
use crate::session::{self, Job};
use crate::workbench::demo::demo_logs_in;
use crate::workbench::error::Broken;
use crate::workbench::{WorkbenchConfig, saved};

fn is_done(desk: &Value) -> bool {
    desk["tick"]["search"]["state"] == "done"
}

fn chosen(desk: &Value) -> Value {
    let models = desk["models"].as_array().expect("models");
    models.iter().find(|model| model["id"] == desk["chosen"]).expect("it is there").clone()
}

/// The model as `extend` makes it by hand of the same logs.
fn by_hand(logs: &[PathBuf], effects: &[String]) -> Model {
    let [fit, held_out]: [Vec<ScreenedLog>; 2] =
        [&logs[0], &logs[1]].map(|path| vec![csv::read(path).expect("a log").into()]);
    let (cancel, config) = (Cancel::default(), DiagnoseConfig::default());
    let job = Job::unwatched(&cancel);
    session::extend(&Model::paper(), effects, (&fit, &held_out), &config, &job)
        .expect("it fits")
        .extension
        .model
}

/// What follows begins with its file: the command that writes it is one of those that were done.
#[test]
fn a_tried_model_that_is_worked_on_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = demo_logs_in(folder.path()).expect("recorded");
    let it = Running::with(&demo.logs);
    it.wait_for("open", super::law::are_open);
    assert_eq!(it.act("{\"act\":\"try\",\"effects\":[\"torque_bias\"]}").status, 200);
    let desk = it.wait_for("tried", |desk| is_done(desk) && desk["models"][1]["is_tried"] == true);
    let done = desk["done"].as_array().expect("commands").len();
    let choose = json!({ "act": "choose", "model": desk["models"][1]["id"] }).to_string();
    assert_eq!(it.act(&choose).status, 200);
    let desk = it.json("/api/desk");
    assert_eq!(chosen(&desk)["is_made"], true);
    let commands = desk["done"].as_array().expect("commands");
    assert_eq!(commands.len(), done + 1);
    let last = commands[done].as_str().expect("a command");
    assert!(last.contains("extend --model paper --effect torque_bias"), "{last}");
    assert!(last.ends_with(" -o step-1.toml"), "{last}");
    let session = folder.path().join("session.toml");
    fs::write(&session, it.get("/api/export?what=session").body).expect("written");
    let saved = saved::read(&session).expect("it reads");
    assert_eq!((saved.chosen.as_str(), saved.chosen_model), ("step-1", Some(1)));
    // The paper's model stays: everything starts from it.
    let close = json!({ "act": "close_model", "model": desk["models"][0]["id"] }).to_string();
    assert_eq!(it.act(&close).status, 409);
}

#[test]
fn what_is_missing_is_found_added_and_taken_back_as_by_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = demo_logs_in(folder.path()).expect("recorded");
    let it = Running::with(&demo.logs);
    let is_compared = |desk: &Value| {
        desk["logs"]
            .as_array()
            .is_some_and(|logs| logs.iter().all(|log| log["compared"]["blocks"].is_array()))
    };
    let desk = it.wait_for("compared", is_compared);
    assert_eq!((&desk["logs"][0]["role"], &desk["logs"][1]["role"]), (&json!("fit"), &json!("held_out")));
    assert_eq!(it.act("{\"act\":\"diagnose\"}").status, 200);
    let desk = it.wait_for("answered", |desk| desk["answered"].is_object());
    assert_eq!(desk["answered"]["verdict"], "missing_effect");
    let effects: Vec<String> = serde_json::from_value(desk["answered"]["effects"].clone()).expect("ids");
    let (fall, error) = (&desk["answered"]["fall"], &desk["answered"]["error"]);
    assert_eq!((&fall["after"], &fall["floor"]), (&error["extended"]["validate"], &error["noise_floor"]));
    assert!(fall["before"].as_f64() > fall["after"].as_f64(), "{fall}");
    assert!(fall["explained"].as_f64().is_some_and(|share| share > 0.9), "{fall}");
    let next = desk["answered"]["next"][0]["command"].as_str().expect("a command");
    assert!(next.contains(&effects[0]) && next.ends_with(" -o extended.toml"), "{next}");
    let add = json!({ "act": "add", "effects": effects }).to_string();
    assert_eq!(it.act(&add).status, 200);
    let desk = it.wait_for("added", |desk| {
        is_done(desk) && desk["models"].as_array().is_some_and(|all| all.len() == 2)
    });
    let mut expected = by_hand(&demo.logs, &effects);
    expected.name = "step-1".to_owned();
    let rung = &chosen(&desk)["ladder"][0];
    assert_eq!(
        rung["error"]["validate_after"],
        json!(expected.ladder[0].error.validate_after),
        "to the last digit"
    );
    assert!(expected.ladder[0].error.validate_after < expected.ladder[0].error.validate_before);
    let exported = it.get("/api/export?what=model");
    assert!(exported.head.contains("filename=\"step-1.toml\""), "{}", exported.head);
    assert_eq!(exported.body, expected.emit().expect("text"), "byte for byte");
    let last = desk["done"].as_array().and_then(|done| done.last()).expect("a command").to_string();
    assert!(last.contains("extend --model paper --effect") && last.contains("-o step-1.toml"), "{last}");
    assert_eq!(it.act("{\"act\":\"step_back\"}").status, 200);
    let desk = it.json("/api/desk");
    assert_eq!(chosen(&desk)["ladder"], json!([]));
    let mut back = session::step_back(&expected).expect("a step");
    back.name = "step-2".to_owned();
    assert_eq!(it.get("/api/export?what=model").body, back.emit().expect("text"));
    assert_eq!(it.act("{\"act\":\"step_back\"}").status, 409, "the ladder is empty");
    session_opens_again(&it, &demo.logs, folder.path());
}

/// What was saved is there again, and a log that has changed since is said.
fn session_opens_again(it: &Running, logs: &[PathBuf], folder: &std::path::Path) {
    let file = folder.join("session.toml");
    fs::write(&file, it.get("/api/export?what=session").body).expect("written");
    let read = saved::read(&file).expect("it reads");
    assert_eq!((read.logs.len(), read.models.len(), read.chosen.as_str()), (2, 3, "step-2"));
    let text = fs::read_to_string(&logs[1]).expect("a log");
    let (rest, _) = text.trim_end().rsplit_once('\n').expect("rows");
    fs::write(&logs[1], format!("{rest}\n")).expect("written");
    let again = Running::of(WorkbenchConfig { session: Some(file), ..WorkbenchConfig::default() });
    let is_open = |desk: &Value| {
        desk["logs"].as_array().is_some_and(|logs| logs.iter().all(|log| log["state"] == "open"))
    };
    let desk = again.wait_for("open", is_open);
    assert_eq!(chosen(&desk)["name"], "step-2");
    assert_eq!(
        desk["notices"].as_array().map(Vec::len),
        Some(2),
        "the log, and its answer: {}",
        desk["notices"]
    );
    assert_eq!(again.get("/api/export?what=model&id=3").status, 409, "a log is no model");
}

#[test]
fn a_search_is_cancelled_and_leaves_the_desk_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = demo_logs_in(folder.path()).expect("recorded");
    let it = Running::with(&demo.logs);
    it.wait_for("open", |desk| desk["logs"][1]["state"] == "open" && desk["logs"][0]["state"] == "open");
    assert_eq!(it.act("{\"act\":\"diagnose\"}").status, 200);
    assert_eq!(it.act("{\"act\":\"diagnose\"}").status, 409, "one at a time");
    assert_eq!(it.act("{\"act\":\"cancel\"}").status, 200);
    let desk = it.wait_for("cancelled", |desk| desk["tick"]["search"]["state"] != "running");
    assert_eq!(desk["tick"]["search"]["state"], "cancelled");
    assert!(desk["answered"].is_null());
    assert_eq!(it.act("{\"act\":\"add\",\"effects\":[\"no_such_effect\"]}").status, 200);
    let desk = it.wait_for("refused", |desk| desk["tick"]["search"]["state"] == "failed");
    assert!(desk["tick"]["search"]["why"].to_string().contains("no_such_effect"), "{}", desk["tick"]);
    assert_eq!(desk["models"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_search_that_panics_is_said_and_the_next_one_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = demo_logs_in(folder.path()).expect("recorded");
    let it = Running::with(&demo.logs);
    it.wait_for("open", |desk| desk["logs"][1]["state"] == "open" && desk["logs"][0]["state"] == "open");
    assert_eq!(it.act("{\"act\":\"add\",\"effects\":[\"a mistake\"]}").status, 200);
    let desk = it.wait_for("failed", |desk| desk["tick"]["search"]["state"] == "failed");
    assert_eq!(desk["tick"]["search"]["why"], Broken.to_string());
    assert_eq!(desk["models"].as_array().map(Vec::len), Some(1), "nothing is made of it");
    assert_eq!(it.act("{\"act\":\"diagnose\"}").status, 200);
    it.wait_for("answered", |desk| desk["answered"].is_object());
}

#[test]
fn any_rung_is_looked_at_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = demo_logs_in(folder.path()).expect("recorded");
    let it = Running::with(&demo.logs);
    it.wait_for("open", |desk| desk["logs"][1]["state"] == "open" && desk["logs"][0]["state"] == "open");
    for (count, effect) in [(2, "gravity_pendulum"), (3, "torque_bias")] {
        assert_eq!(it.act(&json!({ "act": "add", "effects": [effect] }).to_string()).status, 200);
        let is_added = |desk: &Value| desk["models"].as_array().is_some_and(|all| all.len() == count);
        it.wait_for("added", |desk| is_done(desk) && is_added(desk));
    }
    let names =
        |desk: &Value| (chosen(desk)["name"].clone(), chosen(desk)["ladder"].as_array().map(Vec::len));
    let rung = |steps: usize| it.act(&json!({ "act": "rung", "steps": steps }).to_string()).status;
    assert_eq!(names(&it.json("/api/desk")), (json!("step-2"), Some(2)));
    // The model of that rung is here; then it is not, and the chosen one is stepped back to there.
    assert_eq!(rung(1), 200);
    let desk = it.json("/api/desk");
    assert_eq!(names(&desk), (json!("step-1"), Some(1)));
    let (first, models) = (&desk["chosen"], desk["models"].as_array().expect("models"));
    let second = models.iter().find(|model| model["name"] == "step-2").expect("it is there");
    assert_eq!(it.act(&json!({ "act": "choose", "model": second["id"] }).to_string()).status, 200);
    assert_eq!(it.act(&json!({ "act": "close_model", "model": first }).to_string()).status, 200);
    assert_eq!(rung(1), 200);
    let desk = it.json("/api/desk");
    assert_eq!(names(&desk), (json!("step-3"), Some(1)));
    let last = desk["done"].as_array().and_then(|done| done.last()).expect("a command").to_string();
    assert!(last.contains("extend --model step-2.toml --step-back -o step-3.toml"), "{last}");
    assert_eq!((rung(0), rung(2)), (409, 409), "the base is no rung, and there is no second one any more");
}
