//! What is seen as a CSV: its times, its channels, each model that is drawn.

use std::fs;

use serde_json::{Value, json};

use super::client::Running;
use super::law::{are_open, teeth};
use crate::cancel::Cancel;
use crate::compare::CompareConfig;
use crate::log::csv;
use crate::model::Model;
use crate::session::{self, Job};

/// Heads and rows.
fn read(text: &str) -> (Vec<&str>, Vec<&str>) {
    let (head, rows) = text.split_once('\n').expect("a head");
    (head.split(',').collect(), rows.lines().collect())
}

fn is_compared(desk: &Value, models: usize) -> bool {
    let logs = desk["logs"].as_array().expect("logs");
    are_open(desk)
        && logs.iter().all(|it| it["compared"]["models"].as_array().is_some_and(|all| all.len() == models))
}

#[test]
fn the_times_that_are_seen_of_every_model_that_is_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let logs = teeth(folder.path());
    let mut other = Model::paper();
    other.name = "<b>".to_owned();
    other.body.inertia *= 2.0;
    fs::write(folder.path().join("other.toml"), other.emit().expect("text")).expect("written");
    let it = Running::with(&logs[..1]);
    let desk = it.wait_for("compared", |desk| is_compared(desk, 1));
    let path = format!("/api/export?what=signals&id={}", desk["logs"][0]["id"]);
    let log = csv::read(&logs[0]).expect("a log").into();
    let cancel = Cancel::default();
    let job = Job::unwatched(&cancel);
    let config = CompareConfig::default();
    let found = session::compare(&[Model::paper()], &[log], &config, &job).expect("compared");
    let raw = csv::read(&logs[0]).expect("a log");
    let by_hand = found[0][0].signals(&raw).expect("columns");
    assert_eq!(it.get(&path).body, csv::emit(&by_hand), "of one model, what `compare --signals` writes");

    let open = json!({ "act": "open_model", "path": folder.path().join("other.toml") });
    assert_eq!(it.act(&open.to_string()).status, 200);
    let desk = it.wait_for("compared", |desk| is_compared(desk, 2));
    let of_two = it.get(&path).body;
    let (heads, rows) = read(&of_two);
    let column = |name: &str| heads.iter().position(|head| *head == name).expect("a column");
    let [one, two] = ["paper", "_b_"].map(|model| column(&format!("{model}.modelled_body_body_rate_rad_s")));
    assert!(rows.iter().any(|row| row.split(',').nth(one) != row.split(',').nth(two)), "two inertias");
    let part = it.get(&format!("{path}&from=2&to=3")).body;
    let (part_heads, part_rows) = read(&part);
    let within = |row: &&str| {
        let time: f64 = row.split(',').next().and_then(|cell| cell.parse().ok()).expect("a time");
        (2.0..=3.0).contains(&time)
    };
    assert_eq!(part_heads, heads);
    assert_eq!(part_rows, rows.iter().copied().filter(within).collect::<Vec<_>>());
    assert_eq!(it.get(&format!("{path}&from=99")).status, 409, "nothing is there");

    // Where each model is worst is its own.
    let errors = &desk["logs"][0]["compared"]["blocks"][0]["errors"];
    assert!(errors[0]["worst_s"].is_array() && errors[1]["worst_s"].is_array(), "{errors}");

    for model in desk["models"].as_array().expect("models") {
        let hide = json!({ "act": "show", "model": model["id"], "shown": false });
        assert_eq!(it.act(&hide.to_string()).status, 200);
    }
    assert_eq!(it.get(&path).body, csv::emit(&raw), "the channels alone");
}
