//! Many benches: whoever diagnoses them, in whatever order, the merged answer is the same.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn rotorbench(folder: &Path, line: &str) -> Output {
    let program = env!("CARGO_BIN_EXE_rotorbench");
    Command::new(program).args(line.split(' ')).current_dir(folder).output().expect("it runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Four benches, of which one has a log that is none, and their plan.
fn benches(folder: &Path) {
    for (number, hidden) in
        [(1, "gravity_pendulum"), (2, "transport_delay"), (3, "gravity_pendulum"), (4, "")]
    {
        let bench = folder.join(format!("logs/bench-{number}"));
        fs::create_dir_all(&bench).expect("made");
        if hidden.is_empty() {
            fs::write(bench.join("train.csv"), "this is no log\n").expect("written");
            continue;
        }
        let line = format!(
            "experiment prbs --lockstep --closed-loop --amplitude 0.03 --duration 12 --seed {number} --sequence {number} --hide {hidden} -o {}",
            bench.join("train.csv").display()
        );
        assert!(rotorbench(folder, &line).status.success());
    }
    let planned = rotorbench(folder, "fleet plan logs/*/ -o plan.toml");
    assert!(planned.status.success(), "{}", said(&planned));
}

fn merged(folder: &Path, answers: &str) -> Vec<u8> {
    let output = rotorbench(folder, &format!("fleet merge {answers} --plan plan.toml --json"));
    assert_eq!(output.status.code(), Some(1), "a bench failed: {}", said(&output));
    output.stdout
}

#[test]
fn a_changed_log_is_diagnosed_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let log = |rows: usize| {
        let rows = (0..rows).map(|row| format!("{},0.5,600\n", 0.02 * row as f64));
        fs::write(
            folder.join("a.csv"),
            format!("time_s,command_1,propeller_rate_1_rad_s\n{}", rows.collect::<String>()),
        )
        .expect("written");
    };
    fs::write(folder.join("plan.toml"), "[[bench]]\nname = \"a\"\nlog = [\"a.csv\"]\n").expect("written");
    // A log that is not there yet is a bench that failed, until it is there.
    let first = rotorbench(folder, "fleet run plan.toml -o answers");
    assert_eq!(first.status.code(), Some(1), "{}", said(&first));
    assert!(said(&first).contains("a.csv: No such file"), "{}", said(&first));
    log(400);
    rotorbench(folder, "fleet run plan.toml -o answers");
    log(500);
    let changed = rotorbench(folder, "fleet run plan.toml -o answers");
    assert!(!said(&changed).contains("is there already"), "{}", said(&changed));
    let of_plan: Value =
        serde_json::from_slice(&rotorbench(folder, "fleet merge answers --plan plan.toml --json").stdout)
            .expect("JSON");
    assert_eq!(of_plan["benches"].as_array().map(Vec::len), Some(1));
    assert_eq!(of_plan["findings"][0]["code"], "answers_not_of_the_plan");
    let of_all: Value =
        serde_json::from_slice(&rotorbench(folder, "fleet merge answers --json").stdout).expect("JSON");
    assert_eq!(of_all["findings"][0]["code"], "answers_of_one_bench");
}

/// Before two hundred benches fail one by one.
#[test]
fn a_plan_says_whose_columns_want_a_mapping() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    for (bench, header) in
        [("a", "time_s,command_1,propeller_rate_1_rad_s"), ("b", "Time (ms),Throttle (%),RPM")]
    {
        fs::create_dir_all(folder.join(bench)).expect("made");
        let rows = (0..40).map(|row| format!("{},0.5,600\n", 0.02 * f64::from(row))).collect::<String>();
        fs::write(folder.join(bench).join("train.csv"), format!("{header}\n{rows}")).expect("written");
    }
    let ours = rotorbench(folder, "fleet plan a -o ours.toml");
    assert_eq!((ours.status.code(), said(&ours).as_str()), (Some(0), ""));
    let both = rotorbench(folder, "fleet plan a b -o both.toml");
    assert!(both.status.success() && said(&both).contains("b/train.csv"), "{}", said(&both));
    assert!(said(&both).contains("mapping = ") && !said(&both).contains("a/train.csv"), "{}", said(&both));
}

#[test]
fn what_is_no_answer_and_no_plan_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::create_dir(folder.join("answers")).expect("made");
    let refused = |line: &str, why: &str| {
        let output = rotorbench(folder, line);
        assert_eq!(output.status.code(), Some(2), "{line}: {output:?}");
        assert!(said(&output).contains(why), "{line}: {}", said(&output));
    };
    refused("fleet merge answers", "answers: no answer of `fleet run`");
    fs::write(folder.join("answers/other.json"), "{\"bench\": 1}").expect("written");
    refused("fleet merge answers", "other.json: this is no answer");
    refused("fleet run nowhere.toml -o answers", "nowhere.toml: No such file");
    fs::write(folder.join("plan.toml"), "[[bench]]\nname = \"a\"\n").expect("written");
    refused("fleet run plan.toml -o answers", "plan.toml: line 1");
    refused("fleet plan nothing-* -o new.toml", "`nothing-*`: no folder with logs");
    fs::write(folder.join("plan.toml"), "[[bench]]\nname = \"a\"\nlog = [\"a.csv\"]\n").expect("written");
    refused("fleet run plan.toml --shard 3/2 -o answers", "`3/2` is no shard");
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    #[test]
    fn shards_in_any_order_say_what_one_process_says() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        benches(folder);
        let whole = rotorbench(folder, "fleet run plan.toml -o whole --pages");
        assert_eq!(whole.status.code(), Some(1), "{}", said(&whole));
        assert!(said(&whole).contains("4 of 4: bench-4 ... failed: "), "{}", said(&whole));
        let answer: Value = serde_json::from_slice(&merged(folder, "whole")).expect("JSON");
        assert_eq!(
            (answer["failed"].as_u64(), answer["benches"].as_array().map(Vec::len)),
            (Some(1), Some(4))
        );
        assert_eq!(answer["effects"][0]["effect"], "gravity_pendulum");
        assert_eq!(answer["effects"][0]["benches"], 2);
        assert!(answer["benches"][3]["error"].as_str().is_some_and(|error| error.contains("bench-4")));
        let page = answer["benches"][0]["page"].as_str().expect("it was asked for").to_owned();
        assert!(folder.join("whole").join(page).is_file());

        for shard in ["3/3", "1/3", "2/3"] {
            rotorbench(folder, &format!("fleet run plan.toml --shard {shard} -o shards --pages"));
        }
        assert!(merged(folder, "whole") == merged(folder, "shards"), "the order has a part in it");

        // What is there is not done again; what is gone is missing, and made anew as it was.
        let before = merged(folder, "shards");
        let answers = fs::read_dir(folder.join("shards")).expect("there").flatten().map(|entry| entry.path());
        let mut answers: Vec<_> =
            answers.filter(|path| path.extension().is_some_and(|it| it == "json")).collect();
        answers.sort();
        fs::remove_file(&answers[0]).expect("removed");
        let missing = rotorbench(folder, "fleet merge shards --plan plan.toml");
        assert!(String::from_utf8_lossy(&missing.stdout).contains("no answer yet: bench-"), "{missing:?}");
        let again = rotorbench(folder, "fleet run plan.toml -o shards --pages");
        assert_eq!(said(&again).matches("is there already").count(), 3, "{}", said(&again));
        assert!(merged(folder, "shards") == before);
    }
}
