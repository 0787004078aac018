//! What the frames of a capture mean is the bench file's to say, here as for the commands; a session remembers it.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Running;
use crate::bench::BenchConfig;
use crate::can::DatabaseConfig;
use crate::log::csv::content_hash;
use crate::model::Model;
use crate::workbench::bench_file::hash_of;
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
        // A database of its own, beside one that is built in.
        let text = text.replace("file = \"bench\"", "file = \"own.dbc\"");
        fs::write(&file, text).expect("written");
        file
    });
    let database = DatabaseConfig { file: "bench".to_owned(), node_mask: None };
    fs::write(folder.join("own.dbc"), database.bytes().expect("built in")).expect("written");
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

/// A session with a capture and an answer about it.
fn session(folder: &Path, capture: &Path, bench: &Path) -> (PathBuf, usize) {
    let (channels, _, it) = opened(WorkbenchConfig { logs: vec![capture.to_owned()], ..load(bench) });
    let session = folder.join("session.toml");
    fs::write(&session, it.get("/api/export?what=session").body).expect("written");
    let mut text = saved::read(&session).expect("it reads");
    text.answers.push(answer(capture));
    fs::write(&session, toml::to_string(&text).expect("text")).expect("written");
    (session, channels)
}

/// What is there when a session is opened again.
#[derive(Debug, PartialEq)]
struct Again {
    channels: usize,
    notices: Vec<String>,
    has_answer: bool,
    names_the_bench: bool,
    /// Of the live view.
    bench: Value,
    /// What would be saved.
    saved: String,
}

impl Again {
    fn of(session: &Path, config: WorkbenchConfig) -> Self {
        let (channels, desk, it) = opened(WorkbenchConfig { session: Some(session.to_owned()), ..config });
        Self {
            channels,
            notices: serde_json::from_value(desk["notices"].clone()).expect("sentences"),
            has_answer: desk["answered"].is_object(),
            names_the_bench: names_the_bench(&desk),
            bench: it.json("/api/live?since=0")["bench"].clone(),
            saved: it.get("/api/export?what=session").body,
        }
    }

    /// The first notice names `bench`, the second what was left out of the session since it is another.
    fn is_of_another(&self, bench: &str) -> bool {
        let [said, left_out] = &self.notices[..] else { return false };
        let is_left_out = left_out.contains("`diagnose`") && left_out.contains("the bench file is not");
        said.contains(bench) && is_left_out && !self.has_answer
    }
}

/// Opened without a word of the bench file a week later, the capture is what it was; of another file, or of none, what was found of
/// it is left out, and both is said.
#[test]
fn a_session_remembers_the_bench_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let (capture, bench) = capture(folder.path());
    let (session, own) = session(folder.path(), &capture, &bench);
    let as_it_was = Again::of(&session, WorkbenchConfig::default());
    assert!(
        as_it_was.notices.is_empty() && as_it_was.has_answer && as_it_was.names_the_bench,
        "{as_it_was:?}"
    );
    assert_eq!((as_it_was.channels, &as_it_was.bench), (own, &json!("kept")));
    assert_eq!(Again::of(&session, load(&bench)), as_it_was);

    // What says nothing of frames changes nothing, and neither does a path that leads there otherwise.
    let text = fs::read_to_string(&bench).expect("a bench");
    fs::write(&bench, text.replace("hold_s = 0.05", "hold_s = 0.06 # longer")).expect("written");
    assert_eq!(Again::of(&session, WorkbenchConfig::default()), as_it_was);
    let around = folder.path().join("..").join(folder.path().file_name().expect("a name")).join("bench.toml");
    assert!(Again::of(&session, load(&around)).notices.is_empty());

    let other = folder.path().join("other.toml");
    fs::write(&other, text.replace("factor = -1", "factor = 1")).expect("written");
    let found = Again::of(&session, load(&other));
    assert!(found.is_of_another("other.toml") && found.channels == own, "{found:?}");
    fs::copy(&other, &bench).expect("copied");
    assert!(Again::of(&session, WorkbenchConfig::default()).is_of_another("bench.toml"));
    fs::write(&bench, &text).expect("written");
    assert_eq!(Again::of(&session, WorkbenchConfig::default()), as_it_was);

    // A database that it names.
    let database = folder.path().join("own.dbc");
    let frames = fs::read_to_string(&database).expect("a database");
    fs::write(&database, frames + "\nCM_ \"another\";\n").expect("written");
    assert!(Again::of(&session, WorkbenchConfig::default()).is_of_another("bench.toml"));
}

/// Saved while its bench file is away, a session still names it; back again, all is as it was.
#[test]
fn a_bench_file_that_is_away_is_not_forgotten() {
    let folder = tempfile::tempdir().expect("a folder");
    let (capture, bench) = capture(folder.path());
    let (session, own) = session(folder.path(), &capture, &bench);
    let away = folder.path().join("away.toml");
    fs::rename(&bench, &away).expect("moved");
    let found = Again::of(&session, WorkbenchConfig::default());
    let [lost, left_out, _] = &found.notices[..] else { panic!("{found:?}") };
    assert!(lost.contains("bench.toml") && left_out.contains("the built-in bench"), "{found:?}");
    assert!(found.channels < own && !found.has_answer && !found.names_the_bench, "{found:?}");
    assert_eq!(found.bench, "bench");
    fs::rename(&away, &bench).expect("moved");
    let saved = folder.path().join("saved.toml");
    fs::write(&saved, &found.saved).expect("written");
    assert_eq!(Again::of(&saved, WorkbenchConfig::default()).channels, own);
}

/// A pipe in the place of a database, on which nobody ever writes, holds up the log that needs it, and not the server.
#[test]
fn a_pipe_in_the_place_of_a_database_leaves_the_server_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let (capture, bench) = capture(folder.path());
    let database = folder.path().join("own.dbc");
    fs::remove_file(&database).expect("removed");
    assert!(std::process::Command::new("mkfifo").arg(&database).status().expect("it runs").success());
    let it = Running::of(WorkbenchConfig { logs: vec![capture], ..load(&bench) });
    assert_eq!(it.json("/api/desk")["logs"][0]["state"], "opening");
}

/// Read anew after the bench file was changed, a capture is another log: what was found of it then is not of it.
#[test]
fn a_capture_is_of_the_bench_file_as_it_was_when_it_was_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let (capture, bench) = capture(folder.path());
    let (session, _) = session(folder.path(), &capture, &bench);
    let (_, desk, it) = opened(WorkbenchConfig { session: Some(session), ..WorkbenchConfig::default() });
    assert_eq!(desk["answered"]["is_current"], true);
    let text = fs::read_to_string(&bench).expect("a bench");
    fs::write(&bench, text.replace("factor = -1", "factor = 1")).expect("written");
    let frames = fs::read(&capture).expect("a capture");
    fs::write(&capture, &frames).expect("written anew");
    it.act(&json!({ "act": "reread", "log": desk["logs"][0]["id"] }).to_string());
    it.wait_for("read anew", |desk| desk["answered"]["is_current"] == false);
    // The next session has no answer of another reading.
    let saved = folder.path().join("saved.toml");
    fs::write(&saved, it.get("/api/export?what=session").body).expect("written");
    let saved = saved::read(&saved).expect("it reads");
    assert!(saved.answers.is_empty() && saved.logs[0].bench_sha256 == Some(hash_of(Some(&bench))));
}
