//! What was recorded runs again, bit for bit; what was changed is named at the first sample that differs.

use std::path::Path;

use super::{json_schema, rotorbench};
use rotorbench::bench::BenchConfig;
use rotorbench::emulate::Impulse;
use rotorbench::log::{csv, export};
use rotorbench::recording::{RecordedItem, Recorder, RecorderOptions, Recording};
use rotorbench::runtime::lockstep::Lockstep;
use rotorbench::runtime::replay::Replay;
use rotorbench::runtime::{controller_plant, record};

/// A bench at 1 kHz that is struck, so that nothing in it stands still.
fn bench() -> BenchConfig {
    let mut bench = BenchConfig { period_s: 0.001, ..BenchConfig::default() };
    bench.emulator.seed = 7;
    bench.emulator.impulse = vec![Impulse { at_s: 1.0, duration_s: 0.05, torque: 0.6 }];
    bench.emulator.impulse_period_s = 2.0;
    bench
}

/// Runs `bench` in lockstep for `seconds` and records it.
fn record(bench: &BenchConfig, seconds: f64, path: &Path) {
    let metadata = record::metadata(bench, "test", None).expect("the built-in model");
    let recorder = Recorder::start(path, &metadata, RecorderOptions::default()).expect("a new file");
    let emulator = bench.emulator.build().expect("the built-in plant");
    let guard = bench.guard.build(bench.period_s).expect("the built-in guard");
    let source = controller_plant::command_source(bench).expect("the built-in controller");
    let lockstep = Lockstep::new(emulator, source, bench.period_s).guarded(guard);
    let mut sender = recorder.sender();
    let mut state = lockstep.start();
    for _ in 0..(seconds / bench.period_s).round() as u64 {
        lockstep.step(&mut state, &mut sender);
    }
    let summary = recorder.finish().expect("the disk works");
    assert_eq!(summary.dropped, 0);
}

fn replay(
    path: &Path,
    bench: &BenchConfig,
) -> (rotorbench::runtime::replay::ReplayResult, rotorbench::runtime::replay::ReplayResult, u64) {
    let source = controller_plant::command_source(bench).expect("a controller");
    let guard = bench.guard.build(bench.period_s).expect("a guard");
    let mut replay = Replay::new(&source, &guard);
    replay.run(Recording::open(path).expect("a recording")).expect("readable");
    (replay.controller.clone(), replay.guard_result.clone(), replay.equal_events)
}

#[test]
fn a_recording_replays_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    record(&bench(), 10.0, &path);
    let (controller, guard, events) = replay(&path, &bench());
    assert_eq!(
        (controller.equal, controller.starts, controller.is_equal()),
        (10_000, 1, true),
        "{controller:?}"
    );
    assert_eq!((guard.equal, guard.starts, guard.is_equal()), (10_000, 1, true), "{guard:?}");
    assert!(events >= 2, "arming at least");
}

#[test]
fn a_changed_constant_is_named_at_the_first_sample_that_differs() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    record(&bench(), 2.0, &path);
    // By hand: where the command of the changed controller, fed the recorded inputs, first differs.
    let mut changed = bench();
    changed.controller.reference.angle_rad += 1e-9;
    let source = controller_plant::command_source(&changed).expect("a controller");
    let mut state = source.start();
    let mut expected = None;
    for record in Recording::open(&path).expect("a recording") {
        if let RecordedItem::ControlStep(step) = record.expect("readable") {
            let command = source.step(&mut state, &step.sensors, &step.applied);
            let command = rotorbench::signal::Command { stamp_ns: step.command.stamp_ns, ..command };
            if expected.is_none() && command != step.command {
                expected = Some(step.command.sequence);
            }
        }
    }
    let (controller, guard, _) = replay(&path, &changed);
    let first = controller.first_difference.expect("it differs");
    assert_eq!(Some(first.sequence), expected);
    assert_eq!(controller.equal, first.sequence - 1);
    assert!(guard.is_equal(), "the guard is the same and was fed the same");
    assert_ne!(first.difference.recorded, first.difference.replayed);
}

#[test]
fn a_changed_guard_is_named_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    record(&bench(), 3.0, &path);
    let mut changed = bench();
    changed.guard.rotor_maximum = 0.3;
    let (controller, guard, _) = replay(&path, &changed);
    assert!(controller.is_equal(), "the controller is the same and was fed the same");
    let first = guard.first_difference.expect("the limit acts");
    assert!(first.difference.field.starts_with("rotor["), "{first:?}");
}

#[test]
fn what_came_late_or_was_lost_is_not_claimed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    record(&bench(), 1.0, &path);
    let source = controller_plant::command_source(&bench()).expect("a controller");
    let guard = bench().guard.build(bench().period_s).expect("a guard");
    // A recording that begins late.
    let mut late = Replay::new(&source, &guard);
    late.run(Recording::open(&path).expect("a recording").skip(500)).expect("readable");
    assert_eq!(late.controller.equal, 0);
    assert!(late.controller.unknown > 0 && !late.controller.is_equal());
    // A recording with a hole.
    let mut gap = Replay::new(&source, &guard);
    let records = Recording::open(&path).expect("a recording").filter(
        |record| !matches!(record, Ok(RecordedItem::ControlStep(step)) if step.command.sequence == 100),
    );
    gap.run(records).expect("readable");
    assert_eq!((gap.controller.equal, gap.controller.unknown), (99, 900));
    assert!(gap.controller.first_difference.is_none() && gap.guard_result.is_equal());
}

#[test]
fn an_export_holds_what_was_measured_and_what_the_rotors_got() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, csv) = (folder.path().join("run.mcap"), folder.path().join("run.csv"));
    let bench = BenchConfig { period_s: 0.02, ..bench() };
    record(&bench, 5.0, &path);
    let summary = export::write_log(&path, &csv).expect("exported");
    assert_eq!((summary.written, summary.out_of_order, summary.lost), (250, 0, 0));
    let read = csv::read(&csv).expect("our own log");
    let direct = export::dataset(&path).expect("the same in memory");
    assert_eq!(read.time(), direct.time());
    assert_eq!(read.names().collect::<Vec<_>>(), direct.names().collect::<Vec<_>>());
    assert_eq!(read.time()[1], 0.02);
    let steps: Vec<_> = Recording::open(&path)
        .expect("a recording")
        .filter_map(|record| match record.expect("readable") {
            RecordedItem::GuardStep(step) => Some(step),
            _ => None,
        })
        .collect();
    for (row, step) in steps.iter().enumerate() {
        assert_eq!(read.column("command_1").expect("there")[row].to_bits(), step.applied.rotor[0].to_bits());
        let rate = read.column("body_rate_rad_s").expect("there")[row];
        let fresh = row == 0 || steps[row - 1].sensors.body_rate.count != step.sensors.body_rate.count;
        if fresh && step.sensors.body_rate.is_good() {
            assert_eq!(rate.to_bits(), step.sensors.body_rate.value.to_bits());
        } else {
            assert!(rate.is_nan(), "no value that was not measured");
        }
    }
}

#[test]
fn the_command_says_where_they_part_and_refuses_what_is_no_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    record(&bench(), 2.0, Path::new(&at("run.mcap")));
    let equal = rotorbench(&["replay", &at("run.mcap")]);
    let said = String::from_utf8_lossy(&equal.stdout).into_owned();
    assert_eq!(equal.status.code(), Some(0), "{said}{}", String::from_utf8_lossy(&equal.stderr));
    assert!(said.contains("controller: 2000 steps equal"), "{said}");
    let parted =
        rotorbench(&["replay", &at("run.mcap"), "--set", "controller.reference.angle_rad=0.1", "--json"]);
    assert_eq!(parted.status.code(), Some(1));
    let verdict: serde_json::Value = json_schema::answer("replay", &parted.stdout);
    assert!(verdict["controller"]["first_difference"]["sequence"].as_u64().is_some(), "{verdict}");
    assert!(verdict["guard"]["first_difference"].is_null());

    std::fs::write(at("text.mcap"), "not a recording").expect("written");
    std::fs::write(at("empty.mcap"), "").expect("written");
    std::fs::write(at("out.csv"), "precious").expect("written");
    for (arguments, words) in [
        (vec!["replay", "nowhere.mcap"], "nowhere.mcap: No such file"),
        (vec!["replay", &at("text.mcap")], "text.mcap: not a recording: Bad magic number"),
        (vec!["replay", &at("empty.mcap")], "empty.mcap: not a recording"),
        (vec!["replay", &folder.path().display().to_string()], "is a directory"),
        (
            vec!["replay", &at("run.mcap"), "--set", "controller.nothing=1"],
            "the bench file has no `nothing` there",
        ),
        (vec!["replay", &at("run.mcap"), "--set", "period_s=fast"], "the value is not one of TOML"),
        (vec!["replay", &at("run.mcap"), "--set", "period_s=-1.0"], "period_s: -1 is outside"),
        (vec!["export", &at("text.mcap"), "-o", &at("out.csv"), "--force"], "not a recording"),
        (vec!["export", &at("run.mcap")], "nothing to write"),
        (vec!["export", &at("run.mcap"), "-o", &at("run.mcap")], "this command reads that file"),
        (vec!["export", &at("run.mcap"), "-o", &at("out.log")], "give --candump for those"),
    ] {
        let refused = rotorbench(&arguments);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
        assert_eq!(said.trim().lines().count(), 1, "one sentence: {said}");
    }
    assert_eq!(std::fs::read_to_string(at("out.csv")).expect("there"), "precious");
    // Recorded over a bus in memory.
    let none = rotorbench(&["export", &at("run.mcap"), "--candump", &at("none.log")]);
    let said = String::from_utf8_lossy(&none.stdout).into_owned();
    assert!(none.status.code() == Some(1) && said.contains("holds no raw frames"), "{said}");
}
