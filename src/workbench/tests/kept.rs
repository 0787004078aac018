//! What searches said is there again when a session is opened, as long as it holds.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::client::Running;
use super::law::{are_open, teeth};
use crate::log::csv::content_hash;
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

/// What is said of a session whose answers somebody has written, with their hashes.
fn forged(session: &Path, answer: &str) -> Vec<String> {
    let mut saved = saved::read(session).expect("it reads");
    for kept in &mut saved.answers {
        kept.answer = answer.to_owned();
        kept.answer_sha256 = content_hash(answer.as_bytes());
    }
    let file = session.with_file_name("forged.toml");
    fs::write(&file, toml::to_string(&saved).expect("text")).expect("written");
    let (_it, desk) = reopened(&file);
    assert!(desk["answered"].is_null() && desk["discovered"].is_null(), "{answer}");
    notices(&desk)
}

/// What a session names is opened as what is named here: a pipe, from which nothing ever comes, holds nothing up.
#[test]
fn a_session_opens_no_pipe() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = teeth(folder.path());
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("it runs").success());
    let (pipe, log) = (pipe.display(), logs[0].display());
    let text = format!(
        "version = 1\nchosen = \"paper\"\nshows_paper = true\n\
         [[models]]\nfile = \"{pipe}\"\nshown = true\n\
         [[logs]]\npath = \"{log}\"\nsha256 = \"\"\nrole = \"fit\"\nmapping = {{ name = \"{pipe}\" }}\n"
    );
    let file = folder.path().join("session.toml");
    fs::write(&file, text).expect("written");
    let it = Running::of(WorkbenchConfig { session: Some(file), ..WorkbenchConfig::default() });
    let desk = it.json("/api/desk");
    let said = notices(&desk);
    assert!(said.len() == 2 && said.iter().all(|it| it.contains("pipe")), "{said:?}");
    assert_eq!(desk["logs"], json!([]));
}

/// Two models of one name: the one that was worked on is worked on again.
#[test]
fn of_two_models_of_one_name_the_chosen_one_is_chosen_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = teeth(folder.path());
    let models = ["one.toml", "other.toml"].map(|name| folder.path().join(name));
    for (model, inertia) in models.iter().zip([1.0, 2.0]) {
        let mut twin = Model { name: "twin".to_owned(), ..Model::paper() };
        twin.body.inertia *= inertia;
        fs::write(model, twin.emit().expect("text")).expect("written");
    }
    let it = Running::of(WorkbenchConfig { logs, models: models.to_vec(), ..WorkbenchConfig::default() });
    let desk = it.json("/api/desk");
    assert_eq!(desk["chosen"], desk["models"][2]["id"], "the last one");
    let file = folder.path().join("session.toml");
    fs::write(&file, it.get("/api/export?what=session").body).expect("written");
    drop(it);
    let (_it, desk) = reopened(&file);
    assert_eq!(desk["chosen"], desk["models"][2]["id"]);
    assert!(desk["models"][2]["file"].as_str().is_some_and(|file| file.ends_with("other.toml")));
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

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

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

        for answer in ["5", "[]", "{}", "\"x\""] {
            assert_eq!(forged(&file, answer).len(), 2, "{answer}");
        }

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
}
