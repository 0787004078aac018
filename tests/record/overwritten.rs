//! No command writes over what it reads, and none over what is there already unless it is told to.

use std::fs;

use super::rotorbench;

fn refused(arguments: &[&str], words: &str) {
    let output = rotorbench(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(said.contains(words), "{arguments:?}: {said}");
    assert_eq!(said.trim().lines().count(), 1, "one sentence: {said}");
}

#[test]
fn no_result_is_written_over_what_the_command_reads() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (file, round, link, other) = (at("a.csv"), at("./a.csv"), at("link.csv"), at("b.csv"));
    // Refused before anything is read: what is in it does not matter.
    fs::write(&file, "precious").expect("written");
    std::os::unix::fs::symlink(&file, &link).expect("linked");
    for place in [&file, &round, &link].map(String::as_str) {
        for arguments in [
            ["identify", "--log", &file, "-o", place].as_slice(),
            &["identify", "--log", &file, "--report", place],
            &["identify", "--log", &other, "--validate", &other, &file, "-o", place],
            &["identify", "--log", &other, "--template", &file, "-o", place],
            &["extend", "--effect", "torque_bias", "--log", &file, "-o", place],
            &["extend", "--effect", "torque_bias", "--log", &other, "--validate", &file, "-o", place],
            &["extend", "--effect", "torque_bias", "--log", &other, "--model", &file, "-o", place],
            &["extend", "--effect", "torque_bias", "--log", &file, "-o", &other, "--report", place],
            &["extend", "--step-back", "--model", &file, "-o", place],
            &["diagnose", "--log", &file, "--report", place],
            &["diagnose", "--log", &other, "--validate", &file, "--report", place],
            &["diagnose", "--log", &other, "--model", &file, "--report", place],
            &["discover", "--log", &file, "-o", place],
            &["discover", "--log", &other, "--model", &file, "--report", place],
            &["compare", "--log", &file, "--report", place],
            &["compare", "--log", &file, "--signals", place],
            &["compare", "--log", &other, "--model", &file, "--signals", place],
            &["compare", "--runs", &file, "--report", place],
            &["design", "--model", &file, "--report", place],
            &["import", &file, "-o", place],
            &["import", &other, "--mapping", &file, "-o", place],
            &["import", &other, "--config", &file, "-o", place],
            &["export", &file, "-o", place],
            &["export", &file, "--candump", place],
        ] {
            refused(arguments, &format!("{place}: this command reads that file"));
        }
    }
    refused(&["identify", "--log", &file, "-o", &other, "--report", &other], "two results");
    assert_eq!(fs::read_to_string(&file).expect("there"), "precious");
    assert!(fs::symlink_metadata(&link).expect("there").is_symlink(), "a link was replaced");
    assert!(!fs::exists(&other).expect("a folder"), "something was written");
}

/// An experiment writes beside its log, too: there its own bench file may lie, and stays, with `--force` as well.
#[test]
fn an_experiment_leaves_its_bench_file_and_says_what_it_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (bench, model) = (at("q.toml"), at("m.toml"));
    fs::write(&bench, "name = \"q\"\nmodel = \"m.toml\"\n").expect("written");
    fs::write(&model, rotorbench::model::Model::paper().emit().expect("text")).expect("written");
    let experiment = ["experiment", "steps", "--count", "1", "--lockstep", "--config", &bench, "-o"];
    for (log, file) in [(at("q.csv"), &bench), (at("m.csv"), &model)] {
        let before = fs::read_to_string(file).expect("there");
        let words = format!("{file}: this command reads that file");
        refused(&[&experiment[..], &[&log]].concat(), &words);
        refused(
            &[&experiment[..], &[&log, "--force"]].concat(),
            "this command writes FILE.toml: choose another -o",
        );
        assert_eq!(fs::read_to_string(file).expect("there"), before);
        assert!(!fs::exists(&log).expect("a folder"));
    }
    fs::write(at("r.toml"), "mine").expect("written");
    let said =
        "r.toml: is there already; --force replaces it (beside -o FILE.csv this command writes FILE.toml";
    refused(&[&experiment[..], &[&at("r.csv")]].concat(), said);
}

/// One rule for all: what is there is refused before the work begins, and `--force` replaces it.
#[test]
fn nothing_that_is_there_is_replaced_unless_forced() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (log, there, link, pages) = (at("log.csv"), at("there"), at("link"), at("pages"));
    fs::write(&there, "precious").expect("written");
    std::os::unix::fs::symlink(at("nowhere"), &link).expect("linked");
    fs::create_dir(&pages).expect("made");
    fs::write(at("pages/rotorbench-stop.1"), "precious").expect("written");
    fs::write(at("pages/angle.svg"), "precious").expect("written");
    for place in [&there, &link].map(String::as_str) {
        for arguments in [
            ["identify", "--log", &log, "-o", place].as_slice(),
            &["identify", "--log", &log, "--report", place],
            &["extend", "--effect", "torque_bias", "--log", &log, "-o", place],
            &["extend", "--effect", "torque_bias", "--log", &log, "-o", &at("new.toml"), "--report", place],
            &["extend", "--step-back", "-o", place],
            &["diagnose", "--log", &log, "--report", place],
            &["discover", "--log", &log, "-o", place],
            &["compare", "--log", &log, "--report", place],
            &["compare", "--log", &log, "--signals", place],
            &["compare", "--runs", &log, "--report", place],
            &["design", "--report", place],
            &["import", &log, "-o", place],
            &["import", &log, "--write-mapping", place],
            &["export", &log, "-o", place],
            &["export", &log, "--candump", place],
            &["experiment", "ramp", "--lockstep", "-o", place],
            &["run", "--lockstep", "--seconds", "1", "--record", place],
            &["run", "--record", place],
            &["record", "-o", place],
            &["jitter", "--report", place],
            &["jitter", "--histogram", place],
            &["paper", "--report", place],
        ] {
            refused(arguments, &format!("{place}: is there already; --force replaces it"));
        }
    }
    refused(&["man", &pages], &format!("{}: is there already", at("pages/rotorbench-stop.1")));
    refused(&["demo", "--out", &pages], &format!("{}: is there already", at("pages/angle.svg")));
    assert_eq!(fs::read_to_string(&there).expect("there"), "precious");
    assert!(!fs::exists(at("nowhere")).expect("a folder"), "written through a link");
    // Forced, the file is replaced whole, and a link leads to the new one.
    fs::write(&log, "time_s,command_1\n0,0.5\n0.02,0.5\n").expect("written");
    for place in [&there, &link].map(String::as_str) {
        let forced = rotorbench(&["import", &log, "-o", place, "--force"]);
        assert!(forced.status.success(), "{}", String::from_utf8_lossy(&forced.stderr));
        assert!(fs::read_to_string(place).expect("there").contains("0.02,0.5"));
    }
    assert!(
        fs::symlink_metadata(&link).expect("there").is_symlink()
            && fs::exists(at("nowhere")).expect("a folder")
    );
    let record = ["run", "--lockstep", "--seconds", "1", "--record", &there, "--force"];
    assert!(rotorbench(&record).status.success());
    assert!(fs::read(&there).expect("there").starts_with(b"\x89MCAP"), "the recording is in its place");
    assert!(rotorbench(&["man", &pages, "--force"]).status.success());
    assert_ne!(fs::read_to_string(at("pages/rotorbench-stop.1")).expect("there"), "precious");
}

#[test]
fn no_experiment_is_written_over_another() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let log = at("first.csv");
    let record = ["experiment", "constant", "--levels", "0.4", "--hold", "1", "--lockstep", "-o", &log];
    let first = rotorbench(&record);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let (text, plan) = (fs::read(&log).expect("a log"), fs::read(at("first.toml")).expect("a plan"));
    let again = [&record[..], &["--seed", "2"]].concat();
    refused(&again, &format!("{log}: is there already"));
    // Nor is what goes beside it: here the plan, and on a running bench the recording.
    fs::rename(&log, at("moved.csv")).expect("moved");
    refused(&again, &format!("{}: is there already", at("first.toml")));
    fs::write(at("run.mcap"), "somebody's").expect("written");
    let on_bench = ["experiment", "constant", "--levels", "0.4", "-o", &at("run.csv")];
    refused(&on_bench, &format!("{}: is there already", at("run.mcap")));
    refused(&["experiment", "ramp", "--lockstep", "-o", &at("ramp.toml")], "two results");
    assert!(!fs::exists(at("ramp.toml")).expect("a folder") && !fs::exists(&log).expect("a folder"));
    assert_eq!(fs::read(at("moved.csv")).expect("a log"), text);
    assert_eq!(fs::read(at("first.toml")).expect("a plan"), plan);
}

/// `-o /dev/stdout >> log` adds to the log.
#[test]
fn what_standard_output_leads_to_keeps_what_it_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let (log, out) = (folder.path().join("log.csv"), folder.path().join("out"));
    fs::write(&log, "time_s,command_1\n0,0.5\n0.02,0.5\n").expect("written");
    fs::write(&out, "precious\n").expect("written");
    let added = fs::OpenOptions::new().append(true).open(&out).expect("there");
    let import = std::process::Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args(["import", log.to_str().expect("UTF-8"), "-o", "/dev/stdout"])
        .stdout(added)
        .status();
    assert!(import.expect("it runs").success());
    let text = fs::read_to_string(&out).expect("there");
    assert!(text.starts_with("precious\n") && text.contains("0.02,0.5"), "{text}");
}
