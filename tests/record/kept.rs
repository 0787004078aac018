//! What users have from version 0.1.0 is read as that version read it: `kept/README.md` says what is there.

use std::fs;
use std::path::{Path, PathBuf};

use rotorbench::log::csv;
use rotorbench::model::{Measure, Model};
use serde_json::Value;

use super::rotorbench;

fn kept(name: &str) -> String {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/record/kept");
    folder.join(name).to_str().expect("UTF-8").to_owned()
}

fn json(name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(kept(name)).expect("readable")).expect("JSON")
}

/// Every column of the log of that day is in today's, value by value; today's may have more.
fn assert_holds(today: &Path, kept_log: &str) {
    let (now, then) = (csv::read(today).expect("a log"), csv::read(kept(kept_log).as_ref()).expect("a log"));
    assert_eq!(now.time(), then.time());
    for name in then.names() {
        let [now, then] =
            [&now, &then].map(|log| log.column(name).unwrap_or_else(|| panic!("`{name}` is gone")));
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        assert!(now.len() == then.len() && now.iter().zip(then).all(same), "`{name}` of {kept_log}");
    }
}

/// Runs the program, which has to succeed.
fn made(arguments: &[&str]) -> Vec<u8> {
    let done = rotorbench(arguments);
    assert_eq!(done.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    done.stdout
}

#[test]
fn a_recording_of_version_0_1_0_is_exported_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let today = folder.path().join("today.csv");
    made(&["export", &kept("recording.mcap"), "-o", today.to_str().expect("UTF-8")]);
    assert_holds(&today, "recording.csv");
}

#[test]
fn logs_that_version_0_1_0_imported_are_imported_as_they_were() {
    let folder = tempfile::tempdir().expect("a folder");
    let today = folder.path().join("today.csv");
    let output = today.to_str().expect("UTF-8");
    made(&["import", &kept("candump.log"), "--config", &kept("bench.toml"), "-o", output]);
    assert_holds(&today, "candump.csv");
    made(&["import", &kept("foreign.csv"), "--mapping", &kept("mapping.toml"), "-o", output, "--force"]);
    assert_holds(&today, "foreign_si.csv");
}

/// Every field of `then` is in `now` with the same value.
fn assert_contains(now: &Value, then: &Value, place: &str) {
    match (now, then) {
        (Value::Object(now), Value::Object(then)) => {
            for (key, value) in then {
                let place = format!("{place}.{key}");
                assert_contains(now.get(key).unwrap_or_else(|| panic!("{place} is gone")), value, &place);
            }
        }
        (Value::Array(now), Value::Array(then)) => {
            assert_eq!(now.len(), then.len(), "{place}");
            now.iter().zip(then).for_each(|(now, then)| assert_contains(now, then, place));
        }
        _ => assert_eq!(now, then, "{place}"),
    }
}

#[test]
fn a_bench_file_of_version_0_1_0_means_what_it_meant() {
    let today: Value =
        serde_json::from_slice(&made(&["check", "--config", &kept("bench.toml"), "--json"])).expect("JSON");
    let mut then = json("check.json");
    // What the machine of that day said of its interface is nothing that the file means.
    for of_machine in ["interface_state", "warnings"] {
        then.as_object_mut().expect("an object").remove(of_machine).expect("it is there");
    }
    assert_contains(&today, &then, "check");
}

/// A sentence stood there that is a table today.
#[test]
fn what_the_errors_of_a_ladder_of_version_0_1_0_are_of_is_read() {
    let model = Model::load(kept("model.toml").as_ref()).expect("a model");
    let windows = Measure::of_free_runs("body_rate_rad_s", Some(0.4), "rad/s");
    assert_eq!(model.ladder[0].error.measure, windows);
    let today = model.emit().expect("TOML");
    assert!(today.contains("window_s = 0.4") && !today.contains("rms of"), "{today}");
    assert_eq!(Model::parse(&today, "today".as_ref()).expect("reads"), model);
}

#[test]
fn a_model_of_version_0_1_0_predicts_what_it_predicted() {
    let answer = made(&["compare", "--model", &kept("model.toml"), "--log", &kept("attitude.csv"), "--json"]);
    let today: Value = serde_json::from_slice(&answer).expect("JSON");
    let then = json("compare.json");
    let blocks = today["comparisons"][0]["blocks"].as_array().expect("blocks");
    let then = then.as_array().expect("blocks");
    assert_eq!(blocks.len(), then.len());
    for (block, then) in blocks.iter().zip(then) {
        let numbers = ["rms", "noise_floor"]
            .map(|key| [block, then].map(|block| block["error"][key].as_f64().expect("a number")));
        // A free run summed in another order differs in the last digits; a law read otherwise by per cents.
        for [now, was] in numbers {
            assert!((now - was).abs() < 1e-6 * was, "{}: {now} for {was}", then["name"]);
        }
    }
}
