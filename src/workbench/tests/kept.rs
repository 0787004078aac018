//! What searches said is there again when a session is opened, as long as it holds.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Running;
use super::law::{are_open, teeth};
use crate::model::Model;
use crate::workbench::{WorkbenchConfig, saved};

fn reopened(session: &Path) -> (Running, Value) {
    let it = Running::of(WorkbenchConfig { session: Some(session.to_owned()), ..WorkbenchConfig::default() });
    let desk = it.wait_for("open", are_open);
    (it, desk)
}

fn notices(desk: &Value) -> Vec<String> {
    serde_json::from_value(desk["notices"].clone()).expect("sentences")
}

/// A session in which both searches have answered, and what the desk said.
fn session(folder: &Path) -> (PathBuf, Value) {
    let it = Running::with(&teeth(folder));
    it.wait_for("open", are_open);
    for (act, answer) in [("diagnose", "answered"), ("discover", "discovered")] {
        assert_eq!(it.act(&json!({ "act": act }).to_string()).status, 200);
        it.wait_for(answer, |desk| desk[answer].is_object());
    }
    let desk = it.json("/api/desk");
    let file = folder.join("session.toml");
    fs::write(&file, it.get("/api/export?what=session").body).expect("written");
    (file, desk)
}

#[test]
fn answers_are_there_again_until_a_log_a_model_or_their_text_has_changed() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, before) = session(folder.path());
    let (it, desk) = reopened(&file);
    for answer in ["answered", "discovered"] {
        assert_eq!(desk[answer], before[answer], "{answer}");
        assert_eq!(desk[answer]["is_current"], true, "{answer}");
    }
    assert_eq!(notices(&desk), [""; 0]);
    // A law that was kept is added as one that was just found.
    assert_eq!(it.act("{\"act\":\"add_law\"}").status, 200);
    let law = it.get("/api/export?what=model").body;
    assert!(law.contains("discovered_law") && law.starts_with("name = \"law-1\""), "{law}");
    drop(it);

    let text = fs::read_to_string(&file).expect("a session");
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let other = folder.path().join("changed.toml");
        fs::write(&other, text.replace(from, to)).expect("written");
        let (_it, desk) = reopened(&other);
        assert!(desk["answered"].is_null() && desk["discovered"].is_null(), "{from}");
        let said = notices(&desk);
        assert!(said.len() == 2 && said.iter().all(|it| it.contains("ask again")), "{said:?}");
        said
    };
    let program = format!("program = \"{}\"", env!("CARGO_PKG_VERSION"));
    assert!(changed(&program, "program = \"0.0.1\"")[0].contains("0.0.1"));
    // A word of either answer, whatever was found.
    changed("sentence", "sentense");
    let model = saved::read(&file).expect("it reads").answers[0].model_sha256.clone();
    assert!(changed(&model, &"0".repeat(64))[0].contains("paper"));

    // A log that is another now.
    let log = folder.path().join("held_out.csv");
    let rows = fs::read_to_string(&log).expect("a log");
    let (rest, _) = rows.trim_end().rsplit_once('\n').expect("rows");
    fs::write(&log, format!("{rest}\n")).expect("written");
    let (it, desk) = reopened(&file);
    assert!(desk["answered"].is_null() && desk["discovered"].is_null());
    let said = notices(&desk);
    assert_eq!(said.len(), 3, "the log, and both answers: {said:?}");
    assert!(said[1].contains("diagnose") && said[2].contains("discover"), "{said:?}");
    // What is saved of it now has no answer any more.
    let again = folder.path().join("again.toml");
    fs::write(&again, it.get("/api/export?what=session").body).expect("written");
    assert!(saved::read(&again).expect("it reads").answers.is_empty());
    drop(it);
    fs::remove_file(&log).expect("removed");
    let it = Running::of(WorkbenchConfig { session: Some(file), ..WorkbenchConfig::default() });
    let said = notices(&it.json("/api/desk"));
    assert_eq!(said.len(), 3, "a log that has gone, and both answers: {said:?}");
}

#[test]
fn a_model_file_that_has_changed_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = teeth(folder.path());
    let model = folder.path().join("own.toml");
    let text = Model::paper().emit().expect("text");
    fs::write(&model, &text).expect("written");
    let it = Running::of(WorkbenchConfig {
        logs: logs[..1].to_vec(),
        models: vec![model.clone()],
        ..WorkbenchConfig::default()
    });
    it.wait_for("open", are_open);
    let file = folder.path().join("session.toml");
    fs::write(&file, it.get("/api/export?what=session").body).expect("written");
    drop(it);
    fs::write(&model, format!("# A remark.\n{text}")).expect("written");
    assert_eq!(notices(&reopened(&file).1), [""; 0], "the same model");
    let mut other = Model::paper();
    other.body.inertia *= 2.0;
    fs::write(&model, other.emit().expect("text")).expect("written");
    let said = notices(&reopened(&file).1);
    assert!(said.len() == 1 && said[0].contains("own.toml"), "{said:?}");
}
