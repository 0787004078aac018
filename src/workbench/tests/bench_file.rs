//! What the frames of a capture mean is the bench file's to say, here as for the commands; a session remembers it.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Running;
use crate::bench::BenchConfig;
use crate::log::csv::content_hash;
use crate::model::Model;
use crate::workbench::kept::{KeptSearch, SavedAnswer, hash};
use crate::workbench::{WorkbenchConfig, saved};

/// A capture, and the bench file that says all of it.
fn capture(folder: &Path) -> (PathBuf, PathBuf) {
    let kept = [
        ("candump.log", include_str!("../../../tests/record/kept/candump.log")),
        ("bench.toml", include_str!("../../../tests/record/kept/bench.toml")),
    ];
    let [capture, bench] = kept.map(|(name, text)| {
        let file = folder.join(name);
        fs::write(&file, text).expect("written");
        file
    });
    (capture, bench)
}

fn load(file: &Path) -> WorkbenchConfig {
    let bench = BenchConfig::load(Some(file)).expect("a bench");
    WorkbenchConfig { bench, bench_file: Some(file.to_owned()), ..WorkbenchConfig::default() }
}

/// How many channels it has, and the desk.
fn opened(config: WorkbenchConfig) -> (usize, Value, Running) {
    let it = Running::of(config);
    let desk = it.wait_for("compared", |desk| desk["logs"][0]["is_compared"] == true);
    (desk["logs"][0]["channels"].as_array().expect("channels").len(), desk, it)
}

fn names_the_bench(desk: &Value) -> bool {
    desk["logs"][0]["by_hand"].as_str().expect("a command").contains("--config")
}

#[test]
fn a_capture_is_read_by_the_bench_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let (capture, bench) = capture(folder.path());
    let (built_in, desk, _it) =
        opened(WorkbenchConfig { logs: vec![capture.clone()], ..WorkbenchConfig::default() });
    assert!(!names_the_bench(&desk));
    let (own, desk, _it) = opened(WorkbenchConfig { logs: vec![capture], ..load(&bench) });
    assert!(names_the_bench(&desk));
    assert!(own > built_in, "{own} beside {built_in}");
}

/// An answer that says nothing, of the paper's model and this log.
fn answer(capture: &Path) -> SavedAnswer {
    let model = Model::paper();
    let mut answer = json!({});
    ["verdict", "sentence", "unit"].iter().for_each(|name| answer[name] = json!(""));
    let lists = ["effects", "alternatives", "candidates", "findings", "next"];
    lists.iter().for_each(|name| answer[name] = json!([]));
    ["error", "cards"].iter().for_each(|name| answer[name] = json!({}));
    let answer = answer.to_string();
    SavedAnswer {
        search: KeptSearch::Diagnose,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        model: model.name.clone(),
        model_sha256: hash(&model).expect("text"),
        fit: vec![capture.to_owned()],
        held_out: Vec::new(),
        answer_sha256: content_hash(answer.as_bytes()),
        answer,
        notes: Vec::new(),
        law: None,
    }
}

/// Opened without a word of the bench file a week later, the capture is what it was; of another file, or of none, what was found of
/// it is left out, and both is said.
#[test]
fn a_session_remembers_the_bench_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let (capture, bench) = capture(folder.path());
    let (own, _, it) = opened(WorkbenchConfig { logs: vec![capture.clone()], ..load(&bench) });
    let session = folder.path().join("session.toml");
    fs::write(&session, it.get("/api/export?what=session").body).expect("written");
    drop(it);
    let mut text = saved::read(&session).expect("it reads");
    text.answers.push(answer(&capture));
    fs::write(&session, toml::to_string(&text).expect("text")).expect("written");

    let reopened = |config: WorkbenchConfig| {
        let (channels, desk, it) = opened(WorkbenchConfig { session: Some(session.clone()), ..config });
        let notices: Vec<String> = serde_json::from_value(desk["notices"].clone()).expect("sentences");
        let name = it.json("/api/live?since=0")["bench"].clone();
        (channels, notices, desk["answered"].is_object(), names_the_bench(&desk), name)
    };
    let as_it_was = (own, Vec::new(), true, true, json!("kept"));
    assert_eq!(reopened(WorkbenchConfig::default()), as_it_was);
    assert_eq!(reopened(load(&bench)), as_it_was);
    let other = folder.path().join("other.toml");
    let words = fs::read_to_string(&bench).expect("a bench").replace("factor = -1", "factor = 1");
    fs::write(&other, &words).expect("written");
    let (_, said, has_answer, ..) = reopened(load(&other));
    assert!(said.len() == 2 && said[0].contains("other.toml") && !has_answer, "{said:?}");
    fs::write(&bench, &words).expect("written");
    let (channels, said, has_answer, ..) = reopened(WorkbenchConfig::default());
    assert!(channels == own && said.len() == 2 && said[0].contains("has changed") && !has_answer, "{said:?}");
    fs::remove_file(&bench).expect("removed");
    let (channels, said, has_answer, has_bench, name) = reopened(WorkbenchConfig::default());
    assert!(channels < own && said.len() == 2 && said[0].contains("bench.toml") && !has_answer, "{said:?}");
    assert!(!has_bench && name == "bench");
}
