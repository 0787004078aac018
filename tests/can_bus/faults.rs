//! Faults on the running bench on a real bus: bridge and controller are processes, the ESCs and the IMU are played by
//! this test (which can make them lie) or by a third process (which can be killed). Each fault ends in the safe command
//! as frames on the bus, after a number of periods that the test prints.

use std::os::fd::AsRawFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use rotorbench::can::{Arrival, Port, Roles, RotorCommands};
use rotorbench::clock;
use rotorbench::emulate::Emulator;
use rotorbench::guard::{Cause, State};
use rotorbench::rt;

use crate::bus::Bus;
use crate::processes::{Patience, Process, TestBench, Watcher, late, up_to_six_times};

/// What is wrong with the bench.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Lie {
    Nothing,
    ImuSilent,
    EscSilent,
    ImuFrozen,
    NotANumber,
    /// One frame of the gyro, and the truth after it.
    OneNotANumber,
    OneTooFast,
}

/// ESCs and IMU in a thread of this test.
pub struct Hardware {
    lie: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Hardware {
    pub fn start(bench: &TestBench) -> Self {
        let (lie, stop) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let roles = Roles::build(&bench.config.bus, bench.config.period_s).expect("valid");
        let port = Port::open(&bench.config.bus.interface, false).expect("the bus is up");
        let emulator = bench.config.emulator.build().expect("valid");
        let period_ns = bench.period_ns();
        let thread = std::thread::spawn({
            let (lie, stop) = (Arc::clone(&lie), Arc::clone(&stop));
            move || play(&emulator, &roles, port, period_ns, &lie, &stop)
        });
        Self { lie, stop, thread: Some(thread) }
    }

    /// Begins to lie; when.
    pub fn lie(&self, lie: Lie) -> u64 {
        self.lie.store(lie as u64, Ordering::Relaxed);
        clock::monotonic_ns()
    }
}

impl Drop for Hardware {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn play(
    emulator: &Emulator,
    roles: &Roles,
    mut port: Port,
    period_ns: u64,
    lie: &AtomicU64,
    stop: &AtomicBool,
) {
    let start_ns = clock::monotonic_ns();
    let mut state = emulator.start(start_ns);
    let (mut receiver, mut sender) = (roles.command_receiver(), roles.sensor_sender());
    let mut commands = RotorCommands::default();
    let mut due_ns = start_ns;
    let mut frozen = 0.0;
    while !stop.load(Ordering::Relaxed) {
        let _ = rt::wait([port.as_raw_fd()], due_ns);
        let now_ns = clock::monotonic_ns();
        emulator.advance(&mut state, now_ns - start_ns);
        let _ = port.receive(|arrival| {
            if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
                let updated = roles.decode_commands(&mut receiver, &frame, stamp_ns, &mut commands).updated;
                if updated != 0 {
                    emulator.command(&mut state, commands.rotor);
                }
            }
        });
        if now_ns < due_ns {
            continue;
        }
        due_ns += period_ns;
        let one = [Lie::OneNotANumber as u64, Lie::OneTooFast as u64];
        let told_once = |lie| one.contains(&lie).then_some(0);
        let lie = lie.fetch_update(Ordering::Relaxed, Ordering::Relaxed, told_once).unwrap_or_else(|lie| lie);
        let mut sent = *state.sensors();
        if lie == Lie::NotANumber as u64 || lie == Lie::OneNotANumber as u64 {
            sent.body_rate.value = f64::NAN;
        }
        if lie == Lie::OneTooFast as u64 {
            sent.body_rate.value = 1e6;
        }
        if lie == Lie::ImuFrozen as u64 {
            sent.body_rate.value = frozen;
        }
        frozen = sent.body_rate.value;
        for (index, message) in roles.sensor_messages().iter().enumerate() {
            let silent = match message.name.as_str() {
                "GYRO" => lie == Lie::ImuSilent as u64,
                "ESC_2_STATUS" => lie == Lie::EscSilent as u64,
                _ => false,
            };
            if let Some(frame) = roles.encode_sensors(&mut sender, index, &sent).filter(|_| !silent) {
                let _ = port.send(&frame);
            }
        }
    }
}

/// A bench on a bus of its own, with ESCs whose own timeout is the guard's hold limit: what `SIGKILL` of the bridge
/// leaves is theirs to end.
pub fn bench(test: &str, bus: &Bus) -> TestBench {
    TestBench::new(test, |config| {
        config.bus.interface.clone_from(&bus.name);
        config.emulator.esc_timeout_s = Some(config.guard.hold_s);
        config.emulator.sensors = config.emulator.sensors.clone().at_rate(200.0);
        // The end of a process that locked 200 MB holds the one emulated processor, and the bridge with it, for 200 ms.
        config.real_time.lock_memory = false;
        // A gyro as fine as this one never says the same twice: that it does is a fault.
        config.emulator.sensors.body_rate.quantization = 0.0;
    })
}

pub fn armed_bench(bench: &TestBench) -> (Process, Process, Watcher) {
    let bridge = bench.start(&["bridge"]);
    let control = bench.start(&["control"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    (bridge, control, watcher)
}

/// Listens to the bus itself, as the ESCs do, until both commands are zero after `since_ns`.
pub fn safe_on_the_bus(bench: &TestBench, port: &mut Port, since_ns: u64) -> u64 {
    let roles = Roles::build(&bench.config.bus, bench.config.period_s).expect("valid");
    let (mut receiver, mut commands) = (roles.command_receiver(), RotorCommands::default());
    let (mut at_ns, mut patience) = (0, Patience::seconds(10));
    while at_ns == 0 {
        assert!(patience.lasts(), "no safe command on the bus");
        let _ = rt::wait([port.as_raw_fd()], clock::monotonic_ns() + 100_000_000);
        let _ = port.receive(|arrival| {
            if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
                let updated = roles.decode_commands(&mut receiver, &frame, stamp_ns, &mut commands).updated;
                if updated != 0 && stamp_ns >= since_ns && commands.rotor == [0.0, 0.0] && at_ns == 0 {
                    at_ns = stamp_ns;
                }
            }
        });
    }
    at_ns
}

#[test]
fn every_lie_of_the_sensors_ends_in_the_safe_command() {
    for (lie, name, causes) in [
        (Lie::ImuSilent, "IMU silent", [Cause::SignalStale, Cause::CommandAnswersOldSensors]),
        (Lie::EscSilent, "one ESC silent", [Cause::SignalStale, Cause::SignalStale]),
        (Lie::ImuFrozen, "gyro frozen, frames live", [Cause::SignalFrozen, Cause::SignalFrozen]),
        (Lie::NotANumber, "gyro not a number", [Cause::SignalNotANumber, Cause::SignalFrozen]),
    ] {
        up_to_six_times(|| {
            let bus = Bus::new();
            let bench = bench("lie", &bus);
            let hardware = Hardware::start(&bench);
            let mut port = bus.port();
            let (_bridge, _control, mut watcher) = armed_bench(&bench);
            let at_ns = hardware.lie(lie);
            let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
            bench.judge(name, at_ns, safe_ns);
            watcher.assert_latched(&causes);
            // The truth again arms nothing.
            hardware.lie(Lie::Nothing);
            watcher.assert_latched(&causes);
        });
    }
}

#[test]
fn processes_that_die_or_stand_still_end_in_the_safe_command() {
    for (signal, name) in [(libc::SIGKILL, "SIGKILL"), (libc::SIGSTOP, "SIGSTOP")] {
        for victim in ["control", "emulator"] {
            up_to_six_times(|| {
                let bus = Bus::new();
                let bench = bench("die", &bus);
                let emulator = bench.start(&["emulate", "--can", &bus.name]);
                let mut port = bus.port();
                let (_bridge, control, mut watcher) = armed_bench(&bench);
                let at_ns = clock::monotonic_ns();
                if victim == "control" {
                    control.signal(signal)
                } else {
                    emulator.signal(signal)
                }
                let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
                bench.judge(&format!("{name} of {victim}"), at_ns, safe_ns);
                let causes = [Cause::CommandMissing, Cause::SignalStale, Cause::CommandAnswersOldSensors];
                watcher.assert_latched(&causes);
                if signal == libc::SIGSTOP {
                    std::thread::sleep(Duration::from_secs(1));
                    if victim == "control" {
                        control.signal(libc::SIGCONT)
                    } else {
                        emulator.signal(libc::SIGCONT)
                    }
                    watcher.assert_latched(&causes);
                }
            });
        }
    }
}

/// When the speeds [rad/s] that the ESCs report, the newest of each, were `enough`. Whom the machine held up for so long
/// that the guard latched, before the fault, asks again.
fn when_speeds_are(
    bench: &TestBench,
    port: &mut Port,
    watcher: &mut Watcher,
    mut enough: impl FnMut([f64; 2], u64) -> bool,
) -> u64 {
    let roles = Roles::build(&bench.config.bus, bench.config.period_s).expect("valid");
    let (mut receiver, mut sensors) = (roles.sensor_receiver(), rotorbench::signal::Sensors::default());
    let (mut done, mut patience) = (0, Patience::seconds(10));
    while done == 0 {
        watcher.each(|_| {});
        if watcher.newest.state == State::FailsafeLatched as u32 {
            let said: Vec<String> = watcher.said.iter().map(rotorbench::report::guard::event).collect();
            late(format!("latched before the fault: {said:#?}"));
        }
        assert!(patience.lasts(), "it never happened: {:?}", sensors.propeller_rate);
        let _ = rt::wait([port.as_raw_fd()], clock::monotonic_ns() + 100_000_000);
        let _ = port.receive(|arrival| {
            if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
                roles.decode_sensors(&mut receiver, &frame, stamp_ns, &mut sensors);
                if done == 0 && enough(sensors.propeller_rate.map(|it| it.value), stamp_ns) {
                    done = stamp_ns;
                }
            }
        });
    }
    done
}

#[test]
fn rotors_stop_by_their_own_timeout_when_the_bridge_is_gone() {
    for (signal, name) in [(libc::SIGKILL, "SIGKILL"), (libc::SIGSTOP, "SIGSTOP")] {
        up_to_six_times(|| {
            let bus = Bus::new();
            let bench = bench("bridge", &bus);
            let _emulator = bench.start(&["emulate", "--can", &bus.name]);
            let mut port = bus.port();
            let (bridge, _control, mut watcher) = armed_bench(&bench);
            let (mut cruise, settled_ns) = ([0.0; 2], clock::monotonic_ns() + 1_000_000_000);
            // On a busy machine they may take longer than that second.
            when_speeds_are(&bench, &mut port, &mut watcher, |speed, at_ns| {
                cruise = speed;
                at_ns > settled_ns && cruise.iter().all(|it| *it > 300.0)
            });
            let at_ns = clock::monotonic_ns();
            bridge.signal(signal);
            // With its time constant of 62 ms a rotor that was commanded to stop has lost a fifth of its speed after 14 ms.
            // A speed of zero is one that has not come yet.
            let slowing_ns = when_speeds_are(&bench, &mut port, &mut watcher, |speed, stamp_ns| {
                let slower = |(now, before): (&f64, &f64)| *now > 0.0 && *now < 0.8 * before;
                stamp_ns > at_ns && speed.iter().zip(&cruise).all(slower)
            });
            bench.judge(&format!("{name} of bridge, seen at the rotors' speed"), at_ns, slowing_ns);
            if signal == libc::SIGSTOP {
                std::thread::sleep(Duration::from_secs(1));
                watcher.each(|_| {});
                let at_ns = clock::monotonic_ns();
                bridge.signal(libc::SIGCONT);
                let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
                bench.judge("bridge paused, from its waking", at_ns, safe_ns);
                watcher.assert_latched(&[
                    Cause::GuardPaused,
                    Cause::SignalStale,
                    Cause::CommandMissing,
                    Cause::BusDead,
                ]);
            }
        });
    }
}

#[test]
fn an_interface_that_goes_down_latches_and_carries_zeros_when_it_is_back() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("down", &bus);
        let _hardware = Hardware::start(&bench);
        let (mut bridge, _control, mut watcher) = armed_bench(&bench);
        let at_ns = bus.down();
        let safe = watcher.until_safe(at_ns);
        bench.judge("interface down", at_ns, safe.stamp_ns);
        bus.up();
        assert!(bridge.is_running(), "the bridge survives it");
        let mut port = bus.port();
        safe_on_the_bus(&bench, &mut port, clock::monotonic_ns());
        watcher.assert_latched(&[Cause::BusDead, Cause::SignalStale, Cause::CommandAnswersOldSensors]);
    });
}

/// Of the signals that end a process. All that there are, asked with nothing in flight: tests/bench_faults/.
const SIGNALS: [(libc::c_int, &str); 8] = [
    (libc::SIGINT, "Ctrl-C"),
    (libc::SIGTERM, "SIGTERM"),
    (libc::SIGHUP, "closed terminal"),
    (libc::SIGUSR1, "SIGUSR1"),
    (libc::SIGUSR2, "SIGUSR2"),
    (libc::SIGALRM, "SIGALRM"),
    (libc::SIGABRT, "SIGABRT"),
    (libc::SIGPIPE, "SIGPIPE"),
];

/// In flight, the process that `start` starts ends in frames that say zero.
fn ends_in_zeros(start: impl Fn(&TestBench) -> (Process, Option<Process>)) {
    for (signal, name) in SIGNALS {
        up_to_six_times(|| {
            let bus = Bus::new();
            let bench = bench("end", &bus);
            let _hardware = Hardware::start(&bench);
            let mut port = bus.port();
            let (mut guard, _control) = start(&bench);
            let mut watcher = bench.watch();
            bench.arm_and_wait(&mut watcher);
            // Its queue is full of the frames before, and what a guard says as it ends is said once.
            while port.receive(|_| {}).is_ok_and(|taken| taken > 0) {}
            let at_ns = clock::monotonic_ns();
            guard.signal(signal);
            let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
            bench.judge(name, at_ns, safe_ns);
            assert!(guard.wait().success());
        });
    }
}

#[test]
fn every_way_to_end_the_bridge_ends_in_frames_that_say_zero() {
    ends_in_zeros(|bench| (bench.start(&["bridge"]), Some(bench.start(&["control"]))));
}

#[test]
fn every_way_to_end_a_run_ends_in_frames_that_say_zero() {
    ends_in_zeros(|bench| (bench.start(&["run"]), None));
}
