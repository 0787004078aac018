//! Faults on the running bench over shared memory: real processes, killed and stopped. Each ends in the safe command,
//! after a number of periods that the test prints. The same on a CAN bus: tests/can_bus/faults.rs.

#[path = "../processes/counting.rs"]
mod counting;
#[path = "../json_schema/mod.rs"]
mod json_schema;
mod lockstep;
mod matrix;
mod multicast;
#[path = "../processes/mod.rs"]
mod processes;
mod recorder;

use std::time::Duration;

use processes::{TestBench, Watcher, late, say, up_to_six_times};
use rotorbench::clock;
use rotorbench::guard::{Cause, State};
use rotorbench::shm::{BenchMember, BenchPlace, ProcessRole, REQUEST, STOPS, SharedMemoryConfig};

fn armed_bench(test: &str) -> (TestBench, processes::Process, processes::Process, Watcher) {
    let bench = TestBench::new(test, |_| {});
    let emulator = bench.start(&["emulate", "--shm"]);
    let control = bench.start(&["control"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    (bench, emulator, control, watcher)
}

#[test]
fn a_killed_controller_is_noticed_and_may_come_back() {
    up_to_six_times(|| {
        let (bench, _emulator, control, mut watcher) = armed_bench("kill");
        let at_ns = clock::monotonic_ns();
        control.signal(libc::SIGKILL);
        let safe = watcher.until_safe(at_ns);
        bench.judge("SIGKILL of control", at_ns, safe.stamp_ns);
        watcher.assert_latched(&[Cause::CommandMissing]);
        // A latch is the operator's to acknowledge: a new controller alone moves nothing.
        let _control = bench.start(&["control"]);
        std::thread::sleep(Duration::from_millis(500));
        watcher.assert_latched(&[Cause::CommandMissing]);
        let refused = bench.run(&["arm"]);
        assert_eq!(refused.status.code(), Some(1), "a latched bench is not armed: {refused:?}");
        assert_eq!(bench.run(&["disarm"]).status.code(), Some(0));
        let armed = bench.run(&["arm"]);
        assert_eq!(armed.status.code(), Some(0), "{armed:?}");
        bench.arm_and_wait(&mut watcher);
        let at_ns = clock::monotonic_ns();
        assert_eq!(bench.run(&["stop"]).status.code(), Some(0));
        let stopped = watcher.until_safe(at_ns);
        assert_eq!(stopped.state, State::EmergencyStop as u32);
        say(&format!(
            "stop: rotors commanded to zero {:.1} ms after the command was typed",
            (stopped.stamp_ns - at_ns) as f64 * 1e-6
        ));
    });
}

#[test]
fn a_stopped_controller_is_noticed_and_its_return_moves_nothing() {
    up_to_six_times(|| {
        let (bench, _emulator, control, mut watcher) = armed_bench("pause");
        let at_ns = clock::monotonic_ns();
        control.signal(libc::SIGSTOP);
        let safe = watcher.until_safe(at_ns);
        bench.judge("SIGSTOP of control", at_ns, safe.stamp_ns);
        watcher.assert_latched(&[Cause::CommandMissing]);
        std::thread::sleep(Duration::from_secs(1));
        control.signal(libc::SIGCONT);
        watcher.assert_latched(&[Cause::CommandMissing]);
    });
}

#[test]
fn an_emulator_that_stood_still_latches_when_it_goes_on() {
    up_to_six_times(|| {
        let (bench, emulator, _control, mut watcher) = armed_bench("still");
        emulator.signal(libc::SIGSTOP);
        std::thread::sleep(Duration::from_secs(1));
        // What was let through before the pause does not count.
        watcher.each(|_| {});
        let at_ns = clock::monotonic_ns();
        emulator.signal(libc::SIGCONT);
        let safe = watcher.until_safe(at_ns);
        bench.judge("the guard's process paused for 1 s, from its waking", at_ns, safe.stamp_ns);
        watcher.assert_latched(&[Cause::GuardPaused, Cause::CommandMissing]);
    });
}

#[test]
fn an_emulator_that_was_killed_comes_back_disarmed() {
    up_to_six_times(|| {
        let (bench, emulator, mut control, mut watcher) = armed_bench("back");
        emulator.signal(libc::SIGKILL);
        std::thread::sleep(Duration::from_millis(300));
        let _emulator = bench.start(&["emulate", "--shm"]);
        let at_ns = clock::monotonic_ns();
        let back =
            watcher.until("the new life of the emulator", |it| it.stamp_ns > at_ns && it.sequence < 100);
        assert_eq!((back.state, back.rotor), (State::Disarmed as u32, [0.0, 0.0]));
        assert!(control.is_running(), "the controller runs on");
        bench.arm_and_wait(&mut watcher);
    });
}

#[test]
fn every_way_to_end_the_emulator_ends_in_the_safe_command() {
    for (signal, name) in [
        (libc::SIGINT, "Ctrl-C"),
        (libc::SIGTERM, "SIGTERM"),
        (libc::SIGHUP, "closed terminal"),
        (libc::SIGTSTP, "Ctrl-Z"),
        (libc::SIGUSR1, "SIGUSR1"),
        (libc::SIGUSR2, "SIGUSR2"),
        (libc::SIGALRM, "SIGALRM"),
        (libc::SIGABRT, "SIGABRT"),
        (libc::SIGPIPE, "SIGPIPE"),
        (libc::SIGBUS, "SIGBUS of another process"),
    ] {
        up_to_six_times(|| {
            let (bench, mut emulator, _control, mut watcher) = armed_bench("end");
            let at_ns = clock::monotonic_ns();
            emulator.signal(signal);
            let safe = watcher.until_safe(at_ns);
            bench.judge(name, at_ns, safe.stamp_ns);
            assert!(emulator.wait().success());
            assert_eq!(Cause::from_code(safe.cause), Some(Cause::Shutdown));
        });
    }
}

/// Every signal that would end or suspend a process, at its default, ends this one as Ctrl-C does. (That this is the ramp, the
/// test before holds; here nothing runs, so that all of them are asked.)
#[test]
fn every_signal_that_can_be_caught_ends_the_emulator_by_itself() {
    let harmless = [libc::SIGCHLD, libc::SIGCONT, libc::SIGURG, libc::SIGWINCH, libc::SIGTTIN, libc::SIGTTOU];
    let real_time = [libc::SIGRTMIN(), libc::SIGRTMIN() + 7, libc::SIGRTMAX()];
    let ends = (1..32)
        .filter(|signal| ![libc::SIGKILL, libc::SIGSTOP].contains(signal) && !harmless.contains(signal))
        .chain(real_time);
    let ended = |signal: libc::c_int| {
        let bench = TestBench::new("signal", |_| {});
        let mut emulator = bench.start(&["emulate", "--shm", "--json"]);
        bench.watch().until("a guard", |it| it.sequence > 2);
        for harmless in harmless {
            emulator.signal(harmless);
        }
        std::thread::sleep(Duration::from_millis(50));
        assert!(emulator.is_running(), "not by a signal that means something else:\n{}", emulator.log());
        emulator.signal(signal);
        let status = emulator.wait();
        assert_eq!(status.code(), Some(0), "signal {signal}: {status:?}\n{}", emulator.log());
        let log = emulator.log();
        assert!(log.contains("emulate ends: ") && !log.contains("emulate ends: done"), "{signal}:\n{log}");
    };
    let ends: Vec<_> = ends.collect();
    assert!(ends.len() >= 25, "{ends:?}");
    ends.into_iter().for_each(ended);
}

/// Somebody makes the files of the shared memory shorter while it runs: the guard's process and the controller's end by
/// themselves, in the ramp.
#[test]
fn memory_that_is_taken_away_in_flight_ends_in_the_ramp() {
    up_to_six_times(|| {
        let bench = TestBench::new("taken", |_| {});
        let mut emulator = bench.start(&["emulate", "--shm", "--json"]);
        let mut control = bench.start(&["control"]);
        let mut watcher = bench.watch();
        bench.arm_and_wait(&mut watcher);
        // This process must not look at that memory any more.
        drop(watcher);
        bench.truncate_memory();
        for process in [&mut emulator, &mut control] {
            let status = process.wait();
            assert_eq!(status.code(), Some(0), "{status:?}\n{}", process.log());
            assert!(process.log().contains("shared memory was made shorter"), "{}", process.log());
        }
        let summary: serde_json::Value = serde_json::from_str(&emulator.output()).expect("JSON");
        assert_eq!(summary["state"], "failsafe latched", "{summary:#}");
        if summary["cause"] != "the process is ending" {
            late(format!("another cause was first: {}", summary["cause"]));
        }
    });
}

/// Somebody's `arm` waits for its checks, somebody's `stop` was suspended: the next `stop` must get through.
#[test]
fn a_stop_gets_past_operators_who_hang() {
    up_to_six_times(|| {
        let (bench, _emulator, _control, mut watcher) = armed_bench("hang");
        let member =
            BenchMember::join(&bench.config.name, &SharedMemoryConfig::default(), ProcessRole::Operator)
                .expect("there");
        let _arm = member.publish(&REQUEST).expect("free");
        let _stop = member.publish(&STOPS[0]).expect("free");
        let at_ns = clock::monotonic_ns();
        let stop = bench.run(&["stop"]);
        assert!(stop.status.success(), "{}", String::from_utf8_lossy(&stop.stderr));
        let safe = watcher.until_safe(at_ns);
        assert_eq!(safe.state, State::EmergencyStop as u32);
        assert_eq!(bench.run(&["disarm"]).status.code(), Some(2), "an `arm` still holds its place");
    });
}

#[test]
fn a_stop_on_no_bench_leaves_nothing_behind() {
    let bench = TestBench::new("none", |_| {});
    let place = BenchPlace::of(&bench.config.name, &SharedMemoryConfig::default()).expect("a name");
    for act in ["stop", "arm", "disarm"] {
        let refused = bench.run(&[act]);
        let sentence = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{sentence}");
        assert!(sentence.contains("is not running"), "{sentence}");
        assert!(!place.directory().exists(), "{act} left {}", place.directory().display());
    }
}

/// A `stop` that asks another bench than the one that runs says which one does.
#[test]
fn a_stop_on_another_bench_names_those_that_run() {
    let (other, _emulator, _control, _watcher) = armed_bench("other");
    let refused = TestBench::new("mistaken", |_| {}).run(&["stop"]);
    let sentence = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{sentence}");
    let running = sentence.split_once("running: ").expect("named").1;
    assert!(running.contains(&format!("`{}`", other.config.name)), "{sentence}");
}

/// The guard hears a `stop` though somebody removed the bench's directory; that it cannot answer is said as it is.
#[test]
fn a_stop_whose_answer_cannot_be_seen_says_so() {
    let bench = TestBench::new("removed", |_| {});
    let mut emulator = bench.start(&["emulate", "--shm", "--json"]);
    bench.watch().until("a guard", |it| it.sequence > 10);
    let place = BenchPlace::of(&bench.config.name, &SharedMemoryConfig::default()).expect("a name");
    std::fs::remove_dir_all(place.directory()).expect("removed");
    let stop = bench.run(&["stop"]);
    let sentence = String::from_utf8_lossy(&stop.stderr).into_owned();
    assert_eq!(stop.status.code(), Some(2), "{sentence}");
    assert!(sentence.contains("its directory was removed under process"), "{sentence}");
    assert_eq!(sentence.lines().count(), 1, "{sentence}");
    emulator.signal(libc::SIGTERM);
    assert!(emulator.wait().success());
    let summary: serde_json::Value = serde_json::from_str(&emulator.output()).expect("JSON");
    assert_eq!(summary["state"], "emergency stop", "what was asked for reached it: {summary:#}");
}

#[test]
fn a_second_one_of_either_kind_is_refused_in_one_sentence() {
    up_to_six_times(|| {
        let (bench, _emulator, _control, mut watcher) = armed_bench("second");
        for (command, other) in [(["control"].as_slice(), "control"), (&["emulate", "--shm"], "emulate")] {
            let refused = bench.run(command);
            let sentence = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert_eq!(refused.status.code(), Some(2), "{sentence}");
            assert_eq!(sentence.lines().count(), 1, "{sentence}");
            assert!(sentence.contains(&format!("is published by {other} (process ")), "{sentence}");
        }
        watcher.each(|_| {});
        let state = State::from_code(watcher.newest.state).unwrap_or_default();
        if !state.is_active() {
            late(format!("the loop noticed: {state}, {:?}", watcher.said));
        }
    });
}

/// The bench at both ends of its speeds: what was asked for happens, and every slot is accounted for.
#[test]
fn the_angle_is_held_through_torque_impulses_at_50_hz_and_at_1_khz() {
    for period_s in [0.02, 0.001] {
        up_to_six_times(|| hold(period_s));
    }
}

fn hold(period_s: f64) {
    let bench = TestBench::new("hold", |config| {
        config.period_s = period_s;
        config.guard.arm_checks_s = 0.05;
        // This test is about holding the angle, not about reacting: a busy machine may stop a process for longer
        // than the built-in hold.
        config.guard.hold_s = 0.5;
        config.emulator.esc_timeout_s = Some(1.0);
        config.emulator.impulse =
            vec![rotorbench::emulate::Impulse { at_s: 1.0, duration_s: 0.05, torque: 0.6 }];
        config.emulator.impulse_period_s = 2.0;
    });
    let emulator = bench.start(&["emulate", "--shm"]);
    let mut control = bench.start(&["control", "--json"]);
    let mut monitor = bench.start(&["monitor", "--json"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    // From the first impulse on to the third.
    let until = watcher.newest.stamp_ns + 5_000_000_000;
    watcher.until("five seconds of a run", |applied| applied.stamp_ns > until);
    let state = State::from_code(watcher.newest.state).unwrap_or_default();
    if !state.is_active() {
        late(format!("it ran to the end, and is {state}: {:?}", watcher.said));
    }
    monitor.signal(libc::SIGTERM);
    assert!(monitor.wait().success(), "{}", monitor.log());
    let lines = monitor.output();
    if lines.is_empty() {
        late("not one line of a monitor in five seconds".to_owned());
    }
    for line in lines.lines() {
        json_schema::answer("monitor", line);
    }
    control.signal(libc::SIGTERM);
    assert!(control.wait().success(), "{}", control.log());
    let summary = json_schema::answer("control", control.output());
    let (angle, timing) = (&summary["angle"], &summary["timing"]);
    say(&format!(
        "{} Hz over shared memory: greatest angle error {:.4} rad, late p99 {} µs, skipped {} of {}",
        1.0 / period_s,
        angle["greatest"].as_f64().unwrap_or(f64::NAN),
        timing["lateness"]["p99_us"],
        timing["skipped"],
        timing["slots"],
    ));
    let number = |value: &serde_json::Value| value.as_u64().expect("a number");
    assert_eq!(number(&timing["slots"]), number(&timing["run"]) + number(&timing["skipped"]));
    if (number(&angle["count"]) as f64) < 0.8 * 5.0 / period_s {
        late(format!("held for too few periods: {summary:#}"));
    }
    // An impulse of 0.6 N m for 50 ms turns the body at 0.94 rad/s: unheld, it would be past 0.5 rad in half a
    // second, and against its stop in two.
    let greatest = angle["greatest"].as_f64().expect("a number");
    if greatest >= 0.5 {
        late(format!("not held: {summary:#}"));
    }
    assert!(greatest > 0.02, "the impulses were felt: {summary:#}");
    drop(emulator);
}
