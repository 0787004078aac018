//! The recorder on a running bench: killed in the middle of a write, stopped, refused by its disk. What it promised is
//! there, what it lost is counted, and the loop does not notice.

use std::path::{Path, PathBuf};
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rotorbench::clock;
use rotorbench::guard::State;
use rotorbench::recording::{End, RecordedItem, Recording};

use crate::json_schema;
use crate::processes::{Process, TestBench, Watcher, late, say, up_to_six_times};

fn armed_bench(test: &str, period_s: f64) -> (TestBench, Process, Process, Watcher) {
    let bench = TestBench::new(test, |config| {
        config.period_s = period_s;
        // These tests are about recording: a busy machine may hold a process up for longer than the built-in hold.
        config.guard.hold_s = 0.5;
        config.emulator.esc_timeout_s = Some(1.0);
    });
    let emulator = bench.start(&["emulate", "--shm"]);
    let control = bench.start(&["control"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    (bench, emulator, control, watcher)
}

fn start_recorder(bench: &TestBench, name: &str) -> (Process, PathBuf) {
    let path = bench.file.with_file_name(name);
    let recorder = bench.start(&["record", "-o", &path.display().to_string(), "--json"]);
    (recorder, path)
}

/// Every record that can be read, in order; the rest must be cut off and not damaged.
fn read(path: &Path) -> (Vec<RecordedItem>, Option<End>) {
    let mut recording = Recording::open(path).expect("a recording, however it ended");
    let records = recording.by_ref().map(|record| record.expect("whole records only")).collect();
    (records, recording.end().cloned())
}

fn assert_runs(watcher: &mut Watcher) {
    watcher.each(|_| {});
    let state = State::from_code(watcher.newest.state).unwrap_or_default();
    if !state.is_active() {
        late(format!("the loop noticed: {state}, {:?}", watcher.said));
    }
}

#[test]
fn a_recorder_killed_in_the_middle_of_a_write_leaves_all_but_the_last_second() {
    let mut dice = ChaCha8Rng::seed_from_u64(20);
    let moments: Vec<u64> = (0..5).map(|_| dice.random_range(1_500..3_000)).collect();
    up_to_six_times(|| {
        let (bench, _emulator, _control, mut watcher) = armed_bench("cut", 0.005);
        for (number, moment_ms) in moments.iter().enumerate() {
            let (recorder, path) = start_recorder(&bench, &format!("{number}.mcap"));
            std::thread::sleep(Duration::from_millis(*moment_ms));
            let killed_ns = clock::monotonic_ns();
            recorder.signal(libc::SIGKILL);
            drop(recorder);
            let (records, end) = read(&path);
            let last_ns = records.iter().map(RecordedItem::stamp_ns).max().unwrap_or(0);
            let missing_s = clock::span_s(killed_ns.saturating_sub(last_ns));
            say(&format!(
                "killed after {moment_ms} ms: {} records, the last {:.0} ms old, {end:?}",
                records.len(),
                missing_s * 1e3
            ));
            let steps = records.iter().filter_map(|record| match record {
                RecordedItem::GuardStep(step) => Some(step.applied.sequence),
                _ => None,
            });
            let steps: Vec<u64> = steps.collect();
            assert!(steps.windows(2).all(|pair| pair[0] + 1 == pair[1]), "no hole before the cut");
            assert!(matches!(end, Some(End::CutOff { .. } | End::Whole)), "{end:?}");
            if missing_s > 1.0 {
                late(format!("the last {missing_s:.2} s are missing"));
            }
            assert_runs(&mut watcher);
        }
    });
}

/// A recorder that stands still is the slowest disk of all: the rings in shared memory overtake it.
#[test]
fn back_pressure_is_counted_and_never_felt() {
    up_to_six_times(|| {
        let (bench, _emulator, _control, mut watcher) = armed_bench("slow", 0.001);
        let (mut recorder, path) = start_recorder(&bench, "slow.mcap");
        std::thread::sleep(Duration::from_millis(700));
        recorder.signal(libc::SIGSTOP);
        // The rings hold 1,024 periods.
        std::thread::sleep(Duration::from_millis(2_500));
        recorder.signal(libc::SIGCONT);
        std::thread::sleep(Duration::from_millis(500));
        assert_runs(&mut watcher);
        recorder.signal(libc::SIGINT);
        assert_eq!(recorder.wait().code(), Some(1), "found wanting: {}", recorder.log());
        let summary = json_schema::answer("record", recorder.output());
        let dropped = summary["dropped"].as_u64().expect("a number");
        say(&format!("recorder stopped for 2.5 s at 1 kHz: {summary}"));
        assert!(dropped > 0, "{summary}");
        let (records, end) = read(&path);
        assert_eq!(end, Some(End::Whole));
        let Some(RecordedItem::Status(status)) = records.last() else {
            panic!("the recorder has the last word")
        };
        assert_eq!(status.dropped, dropped, "the file itself says how much is missing");
    });
}

/// A disk that takes no more (here: a limit on the size of files) ends the recording in one sentence, leaves what was
/// written, and is not felt.
#[test]
fn a_disk_that_refuses_ends_the_recording_and_nothing_else() {
    up_to_six_times(|| {
        let (bench, _emulator, _control, mut watcher) = armed_bench("disk", 0.005);
        let path = bench.file.with_file_name("disk.mcap");
        // Of a recorder that was held up all of 600 ms may be one block, which is written whole or not at all.
        let mut recorder = bench.start_limited(2_000_000, &["record", "-o", &path.display().to_string()]);
        assert_eq!(recorder.wait().code(), Some(2), "{}", recorder.log());
        let log = recorder.log();
        assert!(log.contains("the recording cannot be written"), "{log}");
        assert_runs(&mut watcher);
        let (records, end) = read(&path);
        say(&format!("a disk with room for 2 MB: {} records, {end:?}", records.len()));
        assert!(records.len() > 100 && matches!(end, Some(End::CutOff { .. })), "{end:?}");
    });
}
