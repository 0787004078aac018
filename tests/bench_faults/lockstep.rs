//! Lockstep: one process and two give the same bits, run after run; a peer that vanishes drives the failsafe at a
//! period that only its last answer decides, and nobody waits for ever.

use rotorbench::bench::BenchConfig;
use rotorbench::emulate::{Impulse, SensorsConfig};
use rotorbench::runtime::lockstep::digest::Digest;
use rotorbench::runtime::lockstep::{Interference, Lockstep};
use rotorbench::runtime::{controller_plant, emulate};
use rotorbench::signal::Command;
use serde_json::Value;

use crate::json_schema;
use crate::processes::TestBench;

/// The attitude bench, struck each five seconds.
fn attitude(config: &mut BenchConfig) {
    config.emulator.impulse = vec![Impulse { at_s: 0.6, duration_s: 0.05, torque: 0.6 }];
    config.emulator.impulse_period_s = 5.0;
}

fn run(bench: &TestBench, arguments: &[&str]) -> Value {
    let output = bench.run(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    json_schema::answer("run-lockstep", &output.stdout)
}

const ONE: [&str; 5] = ["run", "--lockstep", "--seconds", "60", "--json"];

#[test]
fn ten_runs_of_the_attitude_bench_are_the_same_to_the_last_bit() {
    let bench = TestBench::new("ten", attitude);
    let first = run(&bench, &ONE);
    assert_eq!((first["slots"].as_u64(), first["state"].as_str()), (Some(3000), Some("armed")), "{first:#}");
    assert!(
        first["angle"]["greatest"].as_f64().is_some_and(|it| it > 0.05),
        "the impulses were felt: {first:#}"
    );
    for _ in 1..10 {
        assert_eq!(run(&bench, &ONE)["digest"], first["digest"]);
    }
    // The digest is one of what happened: another noise, another digest.
    let other = TestBench::new("ten", |config| {
        attitude(config);
        config.emulator.seed += 1;
    });
    assert_ne!(run(&other, &ONE)["digest"], first["digest"]);
}

#[test]
fn two_processes_give_the_bits_of_one() {
    // The last one measures so rarely that most steps bring nothing new: an answer is known by its number alone.
    for (period_s, rate_hz) in [(0.02, None), (0.001, None), (0.001, Some(50.0))] {
        let bench = TestBench::new("two", |config| {
            attitude(config);
            config.period_s = period_s;
            if let Some(rate_hz) = rate_hz {
                config.emulator.sensors = SensorsConfig::default().at_rate(rate_hz);
            }
        });
        let seconds = "5";
        let mut control = bench.start(&["control", "--lockstep", "--json"]);
        let mut emulator = bench.start(&["emulate", "--shm", "--lockstep", "--seconds", seconds, "--json"]);
        assert!(emulator.wait().success(), "{}", emulator.log());
        assert!(control.wait().success(), "{}", control.log());
        let two = json_schema::answer("emulate-lockstep", emulator.output());
        let answered = json_schema::answer("control-lockstep", control.output());
        let one = run(&bench, &["run", "--lockstep", "--seconds", seconds, "--json"]);
        assert_eq!(two["digest"], one["digest"], "{period_s} s: {two:#}\n{one:#}");
        assert_eq!((&two["answered"], &two["angle"]), (&one["slots"], &one["angle"]));
        assert_eq!((&answered["answered"], &answered["angle"]), (&one["slots"], &one["angle"]));
    }
}

/// Loses every command from a slot on.
struct Silence(u64);

impl Interference for Silence {
    fn command(&mut self, slot: u64, command: Command) -> Option<Command> {
        (slot < self.0).then_some(command)
    }
}

/// The same run in this thread, with a controller that is silent from slot `answered` on.
fn silent_from(config: &BenchConfig, answered: u64, slots: u64) -> String {
    let guard = config.guard.build(config.period_s).expect("valid");
    let emulator = emulate::emulator(config).expect("valid");
    let source = controller_plant::command_source(config).expect("valid");
    let bench = Lockstep::new(emulator, source, config.period_s).guarded(guard);
    let (mut state, mut digest) = (bench.start(), Digest::default());
    let mut silence = Silence(answered);
    (0..slots).for_each(|_| digest.add(&bench.step(&mut state, &mut silence)));
    digest.text()
}

#[test]
fn a_controller_that_vanishes_drives_the_failsafe_and_the_rest_is_decided_by_its_last_answer() {
    // [periods] after which it is hurt; anywhere in the run.
    for (signal, at) in [(libc::SIGKILL, 137), (libc::SIGKILL, 4_711), (libc::SIGSTOP, 1_009)] {
        let bench = TestBench::new("gone", attitude);
        let control = bench.start(&["control", "--lockstep"]);
        let mut emulator = bench.start(&[
            "emulate",
            "--shm",
            "--lockstep",
            "--seconds",
            "1e6",
            "--patience",
            "0.5",
            "--json",
        ]);
        let mut watcher = bench.watch();
        watcher.until("a run", |applied| applied.sequence > at);
        control.signal(signal);
        // Exit 1: found wanting. Without an end of its own this would last for hours.
        assert_eq!(emulator.wait().code(), Some(1), "{}", emulator.log());
        let summary = json_schema::answer("emulate-lockstep", emulator.output());
        let (slots, answered) = (summary["slots"].as_u64(), summary["answered"].as_u64());
        let (slots, answered) = (slots.expect("a number"), answered.expect("a number"));
        assert!(answered > at, "{summary:#}");
        // Hold, ramp, and the period in which the first answer is missing.
        assert!(slots - answered <= bench.hold_periods() as u64 + 2, "{summary:#}");
        assert_eq!(
            (&summary["state"], &summary["cause"]),
            (&"failsafe latched".into(), &"no fresh command".into())
        );
        assert_eq!(summary["rotor"], serde_json::json!([0.0, 0.0]));
        assert_eq!(summary["digest"].as_str(), Some(silent_from(&bench.config, answered, slots).as_str()));
        if signal == libc::SIGSTOP {
            control.signal(libc::SIGCONT);
        }
    }
}

#[test]
fn an_emulator_that_vanishes_does_not_hold_its_controller() {
    let bench = TestBench::new("left", attitude);
    let mut control = bench.start(&["control", "--lockstep", "--patience", "0.5", "--json"]);
    let emulator = bench.start(&["emulate", "--shm", "--lockstep", "--seconds", "1e6"]);
    bench.watch().until("a run", |applied| applied.sequence > 100);
    emulator.signal(libc::SIGKILL);
    assert_eq!(control.wait().code(), Some(1), "{}", control.log());
    let answered = json_schema::answer("control-lockstep", control.output());
    assert_eq!(answered["complete"], Value::Bool(false));
}
