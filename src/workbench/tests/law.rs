//! A law that no catalogue has, looked for in the page: the same answer and the same files as `discover` and `extend` give.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Running;
use crate::cancel::Cancel;
use crate::diagnose::DiagnoseConfig;
use crate::discover::Discovery;
use crate::effect::Site;
use crate::emulate::HiddenConfig;
use crate::log::csv;
use crate::model::Model;
use crate::report::json::with_sentences;
use crate::screening::ScreenedLog;
use crate::session::{self, Job};
use crate::workbench::demo::record;

/// [s] a law with two numbers wants no more.
const SECONDS: f64 = 8.0;

/// Two runs of a bench whose pivot has teeth.
pub fn teeth(folder: &Path) -> Vec<PathBuf> {
    let law = HiddenConfig {
        effect: "teeth".to_owned(),
        parameters: [("k".to_owned(), 0.04), ("n".to_owned(), 30.0)].into(),
        site: Some(Site::Torque),
        expression: Some("k*sin(n*body_angle)".to_owned()),
    };
    let log = |(name, seed): (&str, u64)| {
        let path = folder.join(name);
        record(&path, Some(law.clone()), seed, SECONDS).expect("recorded");
        path
    };
    [("train.csv", 5), ("held_out.csv", 6)].map(log).to_vec()
}

/// Both logs are read.
pub fn are_open(desk: &Value) -> bool {
    desk["logs"].as_array().is_some_and(|logs| logs.iter().all(|log| log["state"] == "open"))
}

fn chosen(desk: &Value) -> &Value {
    let models = desk["models"].as_array().expect("models");
    models.iter().find(|model| model["id"] == desk["chosen"]).expect("it is there")
}

/// What `discover` finds of the same logs.
fn by_hand(logs: &[PathBuf]) -> Discovery {
    let [fit, held_out]: [Vec<ScreenedLog>; 2] =
        [&logs[0], &logs[1]].map(|path| vec![csv::read(path).expect("a log").into()]);
    let (cancel, config) = (Cancel::default(), DiagnoseConfig::default());
    session::discover(&Model::paper(), &fit, &held_out, &config, &Job::unwatched(&cancel))
        .expect("it searches")
}

#[test]
fn a_law_is_looked_at_added_and_taken_back_as_by_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = teeth(folder.path());
    let it = Running::with(&logs);
    it.wait_for("open", are_open);
    assert_eq!(it.act("{\"act\":\"add_law\"}").status, 409, "none was found");
    assert_eq!(it.act("{\"act\":\"discover\"}").status, 200);
    let desk = it.wait_for("discovered", |desk| desk["discovered"].is_object());
    let mut expected = by_hand(&logs);
    let found = &desk["discovered"];
    assert_eq!((&found["verdict"], &found["is_current"]), (&json!("law"), &json!(true)));
    let said = with_sentences(&expected, &expected.findings).expect("JSON");
    assert_eq!(found["found"], said, "the JSON of the command");
    assert_eq!(desk["models"].as_array().map(Vec::len), Some(1), "nothing is added yet");
    let last = desk["done"].as_array().and_then(|done| done.last()).expect("a command");
    assert_eq!(*last, found["by_hand"]);
    let command = last.as_str().expect("text");
    assert!(command.starts_with("rotorbench discover --model paper --log "), "{command}");
    assert!(command.contains(" --validate ") && command.ends_with(" -o law-1.toml"), "{command}");

    assert_eq!(it.act("{\"act\":\"try_law\"}").status, 200);
    let desk = it.json("/api/desk");
    assert_eq!((&chosen(&desk)["name"], &desk["models"][1]["is_tried"]), (&json!("paper"), &json!(true)));
    assert_eq!(it.act("{\"act\":\"add_law\"}").status, 200);
    let desk = it.json("/api/desk");
    assert_eq!(desk["models"].as_array().map(Vec::len), Some(2), "what was tried is what is added");
    let rung = &chosen(&desk)["ladder"][0];
    assert_eq!(rung["added"], json!(["discovered_law"]));
    let (before, after) = (&rung["error"]["validate_before"], &rung["error"]["validate_after"]);
    assert_eq!((before, after), (&said["error"]["base"]["validate"], &said["error"]["extended"]["validate"]));
    expected.model.name = "law-1".to_owned();
    let exported = it.get("/api/export?what=model");
    assert!(exported.head.contains("filename=\"law-1.toml\""), "{}", exported.head);
    assert_eq!(exported.body, expected.model.emit().expect("text"), "byte for byte");

    assert_eq!(it.act("{\"act\":\"step_back\"}").status, 200);
    let back = session::step_back(&expected.model).expect("a step");
    let desk = it.json("/api/desk");
    assert_eq!((&chosen(&desk)["ladder"], &chosen(&desk)["effects"]), (&json!([]), &json!([])));
    assert!(back.effects.is_empty() && back.parameters() == Model::paper().parameters(), "as it was before");
    assert_eq!(it.act("{\"act\":\"add_law\"}").status, 409, "it was found of another model");
}

#[test]
fn where_the_catalogue_has_the_answer_no_law_is_added_and_a_search_is_cancelled() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = crate::workbench::demo::demo_logs_in(folder.path()).expect("recorded");
    let it = Running::with(&demo.logs);
    it.wait_for("open", are_open);
    assert_eq!(it.act("{\"act\":\"discover\"}").status, 200);
    assert_eq!(it.act("{\"act\":\"discover\"}").status, 409, "one at a time");
    assert_eq!(it.act("{\"act\":\"cancel\"}").status, 200);
    let desk = it.wait_for("cancelled", |desk| desk["tick"]["search"]["state"] != "running");
    assert_eq!((&desk["tick"]["search"]["state"], &desk["discovered"]), (&json!("cancelled"), &Value::Null));
    assert_eq!(it.act("{\"act\":\"discover\"}").status, 200);
    let desk = it.wait_for("discovered", |desk| desk["discovered"].is_object());
    assert_eq!(desk["discovered"]["verdict"], "catalogue");
    let command = desk["discovered"]["by_hand"].as_str().expect("text");
    assert!(!command.contains(" -o "), "there is no law to write: {command}");
    assert_eq!(it.act("{\"act\":\"add_law\"}").status, 409);
}
