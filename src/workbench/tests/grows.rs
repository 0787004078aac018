//! A recording that is being written: what is there by now is read, compared and drawn.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::client::Running;
use super::law::are_open;
use crate::bench::BenchConfig;
use crate::cancel::Cancel;
use crate::compare::CompareConfig;
use crate::model::Model;
use crate::rt::Shutdown;
use crate::runtime::lockstep::run::run;
use crate::session::{self, Job, OpenConfig};

/// Chunks of a recording are some MB: long enough for several.
const SECONDS: f64 = 600.0;

/// The errors of the paper's model as `compare` says them of the file as it is now.
fn by_hand(log: &Path) -> Vec<Value> {
    let cancel = Cancel::default();
    let job = Job::unwatched(&cancel);
    let log = session::open(log, &OpenConfig::default(), &job).expect("it opens").log;
    let found =
        session::compare(&[Model::paper()], &[log], &CompareConfig::default(), &job).expect("compared");
    found[0][0].blocks.iter().map(|block| json!(block.error.rms)).collect()
}

/// The same as the page has them.
fn in_page(desk: &Value) -> Vec<Value> {
    let blocks = desk["logs"][0]["compared"]["blocks"].as_array().expect("blocks");
    blocks.iter().map(|block| block["errors"][0]["rms"].clone()).collect()
}

#[test]
fn an_answer_is_of_the_rows_that_there_were() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = super::law::teeth(folder.path());
    let rows = fs::read_to_string(&logs[0]).expect("a log");
    let lines: Vec<&str> = rows.lines().collect();
    fs::write(&logs[0], lines[..lines.len() - 50].join("\n") + "\n").expect("written");
    let it = Running::with(&logs);
    it.wait_for("open", are_open);
    assert_eq!(it.act("{\"act\":\"diagnose\"}").status, 200);
    let desk = it.wait_for("answered", |desk| desk["answered"].is_object());
    assert_eq!(desk["answered"]["is_current"], true);
    fs::write(&logs[0], &rows).expect("written");
    it.act(&json!({ "act": "reread", "log": desk["logs"][0]["id"] }).to_string());
    let grown =
        |desk: &Value| desk["logs"][0]["rows"].as_u64() > desk["logs"][1]["rows"].as_u64().map(|it| it - 50);
    let desk = it.wait_for("more", grown);
    assert_eq!(desk["answered"]["is_current"], false);
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    #[test]
    fn a_recording_that_grows_is_compared_with_what_is_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let whole = folder.path().join("whole.mcap");
        run(&BenchConfig::default(), SECONDS, Some(&whole), &Shutdown::default()).expect("recorded");
        let bytes = fs::read(&whole).expect("a recording");
        let log = folder.path().join("run.mcap");
        let grown_to =
            |share: f64| fs::write(&log, &bytes[..(share * bytes.len() as f64) as usize]).expect("written");
        grown_to(0.4);
        let it = Running::with(std::slice::from_ref(&log));
        let is_compared = |desk: &Value| are_open(desk) && desk["logs"][0]["is_compared"] == true;
        let reread = |desk: &Value| {
            let act = json!({ "act": "reread", "log": desk["logs"][0]["id"] });
            assert_eq!(it.act(&act.to_string()).status, 200);
        };
        let mut desk = it.wait_for("compared", is_compared);
        assert_eq!(in_page(&desk), by_hand(&log));
        for share in [0.7, 1.0] {
            let rows = desk["logs"][0]["rows"].as_u64().expect("rows");
            grown_to(share);
            reread(&desk);
            desk = it
                .wait_for("more", |desk| desk["logs"][0]["rows"].as_u64() > Some(rows) && is_compared(desk));
            assert_eq!(in_page(&desk), by_hand(&log), "{share}");
            let ends = &desk["logs"][0]["ends_s"];
            let plot = it
                .json(&format!("/api/plot?log={}&pixels=50&channel=body_rate_rad_s", desk["logs"][0]["id"]));
            assert_eq!(plot["ends"], *ends);
        }
        assert_eq!(desk["notices"], json!([]), "that it grows is no surprise");
        // Nothing is new: nobody hears of it.
        let revision = &desk["tick"]["revision"];
        reread(&desk);
        assert_eq!(it.json("/api/desk")["tick"]["revision"], *revision);
        // What can no longer be read stays as it was read.
        let rows = &desk["logs"][0]["rows"];
        fs::write(&log, "no recording").expect("written");
        reread(&desk);
        let stuck = it.wait_for("stuck", |desk| desk["logs"][0]["stuck"].is_string());
        assert_eq!((&stuck["logs"][0]["state"], &stuck["logs"][0]["rows"]), (&json!("open"), rows));
        grown_to(0.7);
        reread(&desk);
        it.wait_for("read", |desk| desk["logs"][0]["stuck"].is_null() && is_compared(desk));
    }
}
