//! `jitter` on this machine, whatever its timing: what it counts adds up, what it writes is read, what it cannot it says.

use std::process::{Command, Stdio};
use std::time::Duration;

use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};
use serde_json::Value;

use super::{json_schema, rotorbench};

const STAGES: [&str; 4] = ["bare", "controller", "shared_memory", "bus"];

fn stage<'a>(measured: &'a Value, name: &str) -> &'a Value {
    let stages = measured["stages"].as_array().expect("stages");
    stages.iter().find(|it| it["stage"] == name).unwrap_or_else(|| panic!("no stage {name}"))
}

fn count(value: &Value) -> u64 {
    value.as_u64().unwrap_or_else(|| panic!("a count, not {value}"))
}

/// What holds for a stage at any load of the machine.
fn assert_adds_up(result: &Value, slots: u64) {
    let timing = &result["timing"];
    let (run, skipped) = (count(&timing["run"]), count(&timing["skipped"]));
    assert_eq!(count(&timing["slots"]), run + skipped, "{result}");
    // The last slot may begin late enough to be a later one.
    assert!(run + skipped >= slots && run > 0, "{result}");
    assert!(
        count(&timing["overruns"]) <= run && count(&timing["longest_overrun"]) <= count(&timing["overruns"])
    );
    for spans in ["lateness", "execution", "response"] {
        assert_eq!(count(&timing[spans]["count"]), run, "{spans}: {result}");
    }
    for spans in ["lateness", "execution", "response", "sensor_age", "sensor_to_command"] {
        let figures = ["p50_us", "p90_us", "p99_us", "p99_9_us", "p99_99_us", "max_us"];
        let figures: Vec<f64> =
            figures.iter().map(|it| timing[spans][it].as_f64().expect("a number")).collect();
        assert!(figures.windows(2).all(|pair| pair[0] <= pair[1]), "{spans}: {figures:?}");
    }
    let rounds = result["rounds"].as_array().expect("rounds");
    assert_eq!(rounds.iter().map(|round| count(&round["count"])).sum::<u64>(), run);
    // Each wait gives the processor away once, at least where it is not late already.
    assert!(count(&result["usage"]["voluntary_context_switches"]) > 0);
    assert!(result["granted"]["processors"].as_array().is_some_and(|it| !it.is_empty()));
}

#[test]
fn stages_add_up_and_the_files_hold_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (log, page) = (at("jitter.hdr"), at("jitter.html"));
    let options = ["jitter", "--json", "--duration-s", "0.6", "--rounds", "3", "--period-us", "2000"];
    let files = ["--histogram", &log, "--report", &page];
    let done = rotorbench(&[&options[..], &files[..]].concat());
    let measured: Value = json_schema::answer("jitter", &done.stdout);
    let mut missed = 0;
    for name in STAGES.iter().filter(|name| **name != "bus") {
        let result = stage(&measured, name);
        assert_eq!(result["rounds"].as_array().map(Vec::len), Some(3));
        assert_adds_up(result, 300);
        missed += count(&result["timing"]["overruns"]) + count(&result["timing"]["skipped"]);
    }
    assert!(count(&stage(&measured, "shared_memory")["timing"]["sensor_to_command"]["count"]) > 0);
    assert_eq!(count(&stage(&measured, "bare")["timing"]["sensor_to_command"]["count"]), 0);
    let bus = stage(&measured, "bus");
    if bus["finding"].is_null() {
        assert_adds_up(bus, 300);
        missed += count(&bus["timing"]["overruns"]) + count(&bus["timing"]["skipped"]);
    } else if !rotorbench::can::kernel_has_can() {
        assert_eq!(bus["finding"]["code"], "bus_unusable", "{bus}");
        assert_eq!(bus["not_measured"], bus["finding"]["evidence"]["reason"]);
    }
    assert_eq!(done.status.code(), Some(i32::from(missed > 0)), "missed slots are exit 1");

    let yardstick = &measured["cyclictest"];
    if yardstick["finding"].is_null() {
        // One value a loop, 100 loops a round; its first thread stops within a loop of that.
        let latencies = count(&yardstick["latency"]["count"]);
        assert!((297..=303).contains(&latencies), "{yardstick}");
        assert!(stage(&measured, "bare")["to_cyclictest"]["p50"].as_f64().is_some_and(|it| it > 0.0));
    } else {
        assert!(stage(&measured, "bare")["to_cyclictest"].is_null());
    }

    let text = std::fs::read_to_string(&log).expect("the histograms");
    let tags: Vec<String> = IntervalLogIterator::new(text.as_bytes())
        .filter_map(|entry| match entry.expect("the format") {
            LogEntry::Interval(interval) => Some(interval.tag()?.as_str().to_owned()),
            _ => None,
        })
        .collect();
    for tag in ["bare.lateness", "controller.execution", "shared_memory.sensor_to_command"] {
        assert!(tags.iter().any(|it| it == tag), "{tag} among {tags:?}");
    }
    let page = std::fs::read_to_string(&page).expect("the report");
    assert!(page.contains("Timing of this machine at 500") && page.contains("with shared memory"));
    assert_nothing_left();
}

/// The benches it made for itself are gone. Their names hold the number of a process that has ended.
fn assert_nothing_left() {
    let entries = std::fs::read_dir("/dev/shm").expect("shared memory").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    for name in names.filter(|name| name.contains("-jitter-")) {
        let digits = name.split("-jitter-").nth(1).unwrap_or("");
        let process: String = digits.chars().take_while(char::is_ascii_digit).collect();
        let runs = std::path::Path::new("/proc").join(&process).exists();
        assert!(runs, "{name} was left in shared memory");
    }
}

#[test]
fn what_cannot_be_measured_is_refused_with_a_sentence() {
    for (options, said) in [
        (&["--duration-s", "0.01"][..], "0.01 s in 5 rounds"),
        (&["--rounds", "0"], "in 0 rounds"),
        (&["--period-us", "5"], "100..=1000000"),
        (&["--duration-s=-1"], "positive number"),
        (&["--priority", "100"], "0..=99"),
        (&["--config", "/nonexistent/bench.toml"], "/nonexistent/bench.toml"),
    ] {
        let done = rotorbench(&[&["jitter"], options].concat());
        let words = String::from_utf8_lossy(&done.stderr);
        assert_eq!((done.status.code(), done.stdout.len()), (Some(2), 0), "{options:?}: {words}");
        assert!(words.contains(said), "{options:?}: {words}");
    }
}

#[test]
fn an_interrupted_measurement_shows_what_it_has() {
    let process = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args(["jitter", "--json", "--duration-s", "600", "--rounds", "1", "--without-cyclictest"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(700));
    // SAFETY: a child of this process that was not waited for: its number is its own.
    unsafe { libc::kill(process.id() as libc::pid_t, libc::SIGINT) };
    let done = process.wait_with_output().expect("it ends");
    let measured: Value = json_schema::answer("jitter", &done.stdout);
    assert_eq!(measured["is_cut_short"], true);
    assert!(stage(&measured, "bus")["timing"].is_null(), "it never came so far");
    assert_eq!(measured["cyclictest"]["rounds"].as_array().map(Vec::len), Some(0));
}
