//! What others send: bad values in frames that are right in everything else, and commands of another sender.

use std::time::Duration;

use rotorbench::can::{Arrival, Frame, Id};
use rotorbench::clock;
use rotorbench::guard::{Cause, State};
use rotorbench::shm::{BUS, BenchMember, ProcessRole, SENSORS};

use crate::bus::{Bus, run};
use crate::faults::{Hardware, Lie, armed_bench, bench, safe_on_the_bus};
use crate::json_schema;
use crate::processes::{Process, TestBench, Watcher, late, say, up_to_six_times};

/// Ends a bridge that was started with `--json`; what it says of the bus.
fn bus_of(mut bridge: Process) -> serde_json::Value {
    bridge.signal(libc::SIGTERM);
    assert!(bridge.wait().success());
    json_schema::answer("bridge", bridge.output())["bus"].clone()
}

fn member(bench: &TestBench) -> BenchMember {
    BenchMember::join(&bench.config.name, &bench.config.shared_memory, ProcessRole::Monitor).expect("joined")
}

/// Starting `cansend` may stop the emulated processor for longer than an echo may take.
fn own_frames_came_back(watcher: &Watcher) {
    if watcher.newest.cause == Cause::BusDead as u32 {
        late(format!("the bridge's own frames come back in time: {:?}", watcher.said));
    }
}

/// `cansend` as the only sender on the bus, so that its frames go on from one another as they should: each is counted
/// under its own cause, exactly.
#[test]
fn cansend_moves_no_rotor_and_is_counted_by_cause() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("cansend", &bus);
        let bridge = bench.start(&["bridge", "--json"]);
        let _control = bench.start(&["control"]);
        let mut watcher = bench.watch();
        watcher.until("a guard", |it| it.sequence > 10);
        // Gyro: counter, temperature, two bytes of nothing, the rate as a float of 32 bits.
        let not_a_number = ["020#001400000000C07F", "020#011400000000807F"];
        let too_fast = ["020#0214000000247449", "020#03140000002474C9"];
        let good = ["020#041400000000003F"];
        let repeated = ["020#041400000000003F", "020#D01400000000003F"];
        let wrong_length = ["020#01", "020#", "041#00", "030#0102030405"];
        let unknown = ["123#DEADBEEF", "1FFFFFFF#00", "7DF#R", "020#R", "010#R"];
        for frame in [&not_a_number[..], &too_fast, &good, &repeated, &wrong_length, &unknown].concat() {
            run("cansend", &[&bus.name, frame]);
        }
        let mut turned = false;
        watcher.each(|applied| turned |= applied.rotor != [0.0, 0.0]);
        own_frames_came_back(&watcher);
        let seen = &watcher.said;
        assert_eq!(watcher.newest.state, State::Disarmed as u32, "none of it is a reason to latch: {seen:?}");
        // And with the command's identifier: full throttle, and no command at all.
        let foreign = ["010#0050C350C3000000", "010#"];
        for frame in foreign {
            run("cansend", &[&bus.name, frame]);
        }
        watcher.until("the latch", |it| it.state == State::FailsafeLatched as u32);
        own_frames_came_back(&watcher);
        assert_eq!(watcher.newest.cause, Cause::ForeignCommand as u32);
        assert_eq!(bench.run(&["arm"]).status.code(), Some(1), "nothing of this arms a bench");
        watcher.each(|applied| turned |= applied.rotor != [0.0, 0.0]);
        assert!(!turned, "a rotor was commanded");
        assert!(bridge.log().contains("another sender commands the rotors"), "{}", bridge.log());
        let decoded = bus_of(bridge)["decoded"].clone();
        say(&format!("cansend, counted by cause: {decoded}"));
        for (cause, frames) in [
            ("not_a_number", not_a_number.len()),
            ("out_of_range", too_fast.len()),
            ("accepted", good.len()),
            ("counter", repeated.len()),
            ("wrong_length", wrong_length.len()),
            ("unknown_id", unknown.len()),
            ("foreign_command", foreign.len()),
        ] {
            assert_eq!(decoded[cause].as_u64(), Some(frames as u64), "{cause}: {decoded}");
        }
    });
}

/// A gyro that says one impossible thing in an otherwise perfect frame, while the bench runs: counted by cause, used by
/// nobody, and no reason to end the run.
#[test]
fn one_impossible_value_in_flight_is_counted_and_used_by_nobody() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("values", &bus);
        let hardware = Hardware::start(&bench);
        let bridge = bench.start(&["bridge", "--json"]);
        let _control = bench.start(&["control"]);
        let mut watcher = bench.watch();
        let member = member(&bench);
        let mut sensors = member.subscribe(&SENSORS).expect("subscribed");
        bench.arm_and_wait(&mut watcher);
        for lie in [Lie::OneNotANumber, Lie::OneTooFast, Lie::OneNotANumber, Lie::OneTooFast] {
            hardware.lie(lie);
            // Longer than the clean periods after which the guard has forgotten it.
            std::thread::sleep(Duration::from_millis(200));
        }
        let mut seen = 0;
        while let Some(sensors) = sensors.next_in_order() {
            assert!(sensors.body_rate.value.abs() < 40.0, "published: {:?}", sensors.body_rate);
            seen += u32::from(sensors.body_rate.health != 0);
        }
        let maximum = bench.config.guard.rotor_maximum;
        watcher.each(|applied| assert!(applied.rotor.iter().all(|rotor| (0.0..=maximum).contains(rotor))));
        let state = State::from_code(watcher.newest.state).unwrap_or_default();
        if !state.is_active() {
            late(format!("it ran on, and is {state}: {:?}", watcher.said));
        }
        assert!(seen >= 4, "the bad values are flagged where they are published: {seen}");
        let decoded = bus_of(bridge)["decoded"].clone();
        say(&format!("impossible values while armed, guard {state}: {decoded}"));
        let count = |cause: &str| decoded[cause].as_u64();
        assert_eq!((count("not_a_number"), count("out_of_range")), (Some(2), Some(2)), "{decoded}");
        assert_eq!((count("counter"), count("foreign_command")), (Some(0), Some(0)), "{decoded}");
    });
}

/// A second node that sends our command's identifier: seen as what it is, whatever it says.
#[test]
fn a_foreign_command_latches_and_our_own_echo_does_not() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("foreign", &bus);
        let _hardware = Hardware::start(&bench);
        let mut port = bus.port();
        let (bridge, _control, mut watcher) = armed_bench(&bench);
        let member = member(&bench);
        let mut status = member.subscribe(&BUS).expect("subscribed");
        let before = status.newest().expect("published each period");
        assert!(before.echoed > 10 && before.foreign_command == 0, "own echo is no foreigner: {before:?}");
        let full = [0, 0x50, 0xC3, 0x50, 0xC3, 0, 0, 0];
        let frame = Frame::classic(Id::Standard(0x10), &full).expect("8 bytes");
        let at_ns = clock::monotonic_ns();
        port.send(&frame).expect("there is room");
        let _ = port.receive(|arrival| assert!(!matches!(arrival, Arrival::Error { .. })));
        let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
        bench.judge("one command of another sender", at_ns, safe_ns);
        watcher.assert_latched(&[Cause::ForeignCommand]);
        assert_eq!(status.newest().expect("published").foreign_command, 1);
        assert!(bridge.log().contains("another sender commands the rotors"), "{}", bridge.log());
        // The other one is silent: the operator may go on.
        bench.arm_and_wait(&mut watcher);
    });
}
