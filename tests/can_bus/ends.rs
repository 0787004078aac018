//! Ends that nobody wished for: a panic in the cycle, an interface that is pulled and plugged in again.

use rotorbench::can::{Arrival, Port, Roles, RotorCommands};
use rotorbench::clock;
use rotorbench::guard::{Cause, State};
use rotorbench::rt::{LogQueue, Shutdown};
use rotorbench::runtime::bridge;
use rotorbench::runtime::bus_io::BusIo;
use rotorbench::shm::{BenchMember, ProcessRole};
use rotorbench::signal::Applied;

use crate::bus::{Bus, ip, receive};
use crate::faults::{Hardware, armed_bench, bench, safe_on_the_bus};
use crate::processes::{Patience, TestBench, late, up_to_six_times};

/// Commands of all frames that arrived, in order.
fn commands(bench: &TestBench, arrivals: &[Arrival]) -> Vec<[f64; 2]> {
    let roles = Roles::build(&bench.config.bus, bench.config.period_s).expect("valid");
    let (mut receiver, mut commands) = (roles.command_receiver(), RotorCommands::default());
    let mut all = Vec::new();
    for arrival in arrivals {
        if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
            roles.decode_commands(&mut receiver, frame, *stamp_ns, &mut commands);
            all.push(commands.rotor);
        }
    }
    all
}

#[test]
fn a_panic_in_the_cycle_leaves_zeros_on_the_bus() {
    let bus = Bus::new();
    let bench = bench("panic", &bus);
    let mut port: Port = bus.port();
    let ended = std::thread::scope(|scope| {
        let cycle = scope.spawn(|| {
            let member =
                BenchMember::join(&bench.config.name, &bench.config.shared_memory, ProcessRole::Bridge);
            let mut bus_io =
                BusIo::open(&bench.config, &member.expect("joined"), LogQueue::new(16), &Shutdown::default())
                    .expect("the bus is up");
            bus_io.send(&Applied { rotor: [0.5, 0.6], ..Applied::default() });
            panic!("a defect, made for this test");
        });
        cycle.join()
    });
    assert!(ended.is_err());
    let arrivals = receive(&mut port, |arrivals| arrivals.len() >= 2);
    let commands = commands(&bench, &arrivals);
    assert!(commands[0][0] > 0.4, "the rotors were commanded: {commands:?}");
    assert_eq!(commands.last(), Some(&[0.0, 0.0]), "{commands:?}");
}

/// A panic on another thread of the process, such as a helper's: the cycle ends as it does when it is asked to.
#[test]
fn a_panic_of_another_thread_ends_the_bridge_in_the_safe_command() {
    let bus = Bus::new();
    let bench = bench("helper", &bus);
    let _hardware = Hardware::start(&bench);
    let mut watcher = bench.watch();
    let shutdown = Shutdown::listen().expect("signals can be listened to");
    let mut port = bus.port();
    let (summary, mut arrivals) = std::thread::scope(|scope| {
        let cycle = scope.spawn(|| bridge::bridge(&bench.config, false, None, &shutdown));
        let _control = bench.start(&["control"]);
        bench.arm_and_wait(&mut watcher);
        // Only what is sent from here on: its queue is full of the frames before.
        while port.receive(|_| {}).is_ok_and(|taken| taken > 0) {}
        let before = receive(&mut port, |arrivals| arrivals.len() > 10);
        let helper = scope.spawn(|| panic!("a defect, made for this test"));
        assert!(helper.join().is_err());
        (cycle.join().expect("the cycle itself does not panic"), before)
    });
    let summary = summary.expect("it ran");
    assert_eq!(shutdown.reason(), "a thread panicked");
    assert_eq!(
        (summary.state.as_str(), summary.cause.as_str()),
        ("failsafe latched", "the process is ending")
    );
    // The cycle may end before it sends one more.
    let _ = port.receive(|arrival| arrivals.push(arrival));
    let commands = commands(&bench, &arrivals);
    // How high does not matter: on a busy machine the guard may still be letting the command rise.
    assert!(commands.iter().any(|rotor| rotor[0] > 0.0), "the rotors turned: {commands:?}");
    assert_eq!(commands.last(), Some(&[0.0, 0.0]), "{commands:?}");
}

/// An adapter that is unplugged and plugged in again is another interface of the same name. Nobody has to be restarted.
#[test]
fn an_interface_that_is_deleted_and_made_again_is_joined_again() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("again", &bus);
        let hardware = Hardware::start(&bench);
        let (mut bridge, _control, mut watcher) = armed_bench(&bench);
        ip(&["link", "delete", &bus.name]);
        let at_ns = clock::monotonic_ns();
        let safe = watcher.until_safe(at_ns);
        bench.judge("interface deleted", at_ns, safe.stamp_ns);
        ip(&["link", "add", "dev", &bus.name, "type", "vcan"]);
        ip(&["link", "set", &bus.name, "mtu", "72", "up"]);
        let mut port = bus.port();
        safe_on_the_bus(&bench, &mut port, clock::monotonic_ns());
        assert!(bridge.is_running(), "the bridge survives it");
        watcher.assert_latched(&[Cause::BusDead, Cause::SignalStale, Cause::CommandAnswersOldSensors]);
        // Sensors come again, too: the operator may go on.
        bench.arm_and_wait(&mut watcher);
        let state = State::from_code(watcher.newest.state).unwrap_or_default();
        if !state.is_active() {
            late(format!("it does not go on, and is {state}: {:?}", watcher.said));
        }
        drop(hardware);
    });
}

/// Somebody of the bench's group makes the files of its shared memory shorter: the bridge is told by a SIGBUS, and ends in
/// frames that say zero.
#[test]
fn memory_that_is_taken_away_ends_the_bridge_in_frames_that_say_zero() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("taken", &bus);
        let _hardware = Hardware::start(&bench);
        let (mut bridge, _control, watcher) = armed_bench(&bench);
        // This process must not look at that memory any more.
        drop(watcher);
        let mut port = bus.port();
        let at_ns = clock::monotonic_ns();
        bench.truncate_memory();
        let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
        bench.judge("shared memory made shorter", at_ns, safe_ns);
        assert!(bridge.wait().success(), "{}", bridge.log());
        assert!(bridge.log().contains("shared memory was made shorter"), "{}", bridge.log());
    });
}

/// `ulimit -f`: the recording has reached its limit, which is told, and nothing else ends. `run` records on a thread of its
/// own, and a signal is a process's.
#[test]
fn a_limit_on_the_recording_is_not_felt_in_flight() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("limit", &bus);
        let _hardware = Hardware::start(&bench);
        let mut watcher = bench.watch();
        let path = bench.file.with_file_name("limited.mcap");
        let mut run = bench.start_limited(LIMIT, &["run", "--record", path.to_str().expect("UTF-8")]);
        bench.arm_and_wait(&mut watcher);
        let mut patience = Patience::seconds(60);
        while !run.log().contains("the recording has ended") {
            assert!(patience.lasts() && run.is_running(), "{}", run.log());
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        // It runs on.
        let end_ns = clock::monotonic_ns() + 1_000_000_000;
        watcher.until("a second more", |it| it.stamp_ns > end_ns);
        let state = State::from_code(watcher.newest.state).unwrap_or_default();
        if !state.is_active() {
            late(format!("it does not run on, and is {state}: {:?}", watcher.said));
        }
        let mut port = bus.port();
        let at_ns = clock::monotonic_ns();
        run.signal(libc::SIGTERM);
        let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
        bench.judge("the end of a run whose recording had ended", at_ns, safe_ns);
        assert_eq!(run.wait().code(), Some(2), "what was asked for is not there: {}", run.log());
        assert!(run.log().contains("error: the recording cannot be written"), "{}", run.log());
    });
}

/// [byte] more than any file of the shared memory, and less than some seconds of a recording.
const LIMIT: u64 = 1_433_600;
