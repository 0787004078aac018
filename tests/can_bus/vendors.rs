//! The bench files of VESCs and ODrives as full benches: sensors in, commands out, a foreign command, and the ESCs' own timeout
//! when nobody commands them any more. And the same frames over other kinds of interfaces: vxcan, and a serial adapter.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, FromRawFd};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use rotorbench::bench::BenchConfig;
use rotorbench::can::{Arrival, Frame, FrameKind, Id, InterfaceStatus, Port, protocol};
use rotorbench::clock;
use rotorbench::guard::{Cause, State};
use rotorbench::signal::Sensors;

use crate::bus::{Bus, ip, run};
use crate::json_schema;
use crate::processes::{Patience, TestBench, late, say, up_to_six_times};

const VESC: &str = include_str!("../../examples/benches/vesc.toml");
const ODRIVE: &str = include_str!("../../examples/benches/odrive.toml");

/// The bench of a template, its loop on one interface. As in `three_processes`: on one emulated processor, starting a program may
/// stop everything for longer than the built-in hold.
fn bench(test: &str, template: &str, interface: &str) -> TestBench {
    TestBench::new(test, |config| {
        let name = std::mem::take(&mut config.name);
        *config = BenchConfig::parse(template, Path::new("template.toml")).expect("valid");
        config.name = name;
        config.bus.interface = interface.to_owned();
        config.guard.hold_s = 0.5;
        config.guard.rotor_maximum = 0.8;
        config.real_time.lock_memory = false;
        config.emulator.esc_timeout_s = Some(0.5);
    })
}

/// Flies for some seconds, the emulator on `far`; the controller's summary.
fn fly(bench: &TestBench, far: &str, seconds: f64) -> serde_json::Value {
    let mut emulator = bench.start(&["emulate", "--can", far, "--json"]);
    let mut run = bench.start(&["run", "--json"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    std::thread::sleep(Duration::from_secs_f64(seconds));
    watcher.each(|_| {});
    let state = State::from_code(watcher.newest.state).unwrap_or_default();
    if !state.is_active() {
        late(format!("it ran to the end, and is {state}: {:?}", watcher.said));
    }
    assert!(bench.run(&["disarm"]).status.success(), "the operator ends the run");
    for process in [&mut run, &mut emulator] {
        process.signal(libc::SIGTERM);
        assert!(process.wait().success(), "{}", process.log());
    }
    let summary = json_schema::answer("run", run.output());
    let greatest = summary["angle"]["greatest"].as_f64().expect("a number");
    if greatest >= 0.5 {
        late(format!("angle error up to {greatest}"));
    }
    let decoded = &summary["bus"]["decoded"];
    for cause in ["wrong_length", "not_a_number", "out_of_range", "foreign_command"] {
        assert_eq!(decoded[cause].as_u64().unwrap_or(0), 0, "{cause}: {decoded}");
    }
    let emulated: serde_json::Value = serde_json::from_str(&emulator.output()).expect("JSON");
    assert!(emulated["commands"]["accepted"].as_u64() > Some(100), "{emulated}");
    summary
}

/// [rad/s] speed of the first rotor as its ESC says it on the bus, until `enough`.
fn rotor_speed(bench: &TestBench, port: &mut Port, enough: impl Fn(f64) -> bool) -> f64 {
    let mut end = protocol(&bench.config.bus, bench.config.period_s).expect("valid").bridge_end();
    let (mut sensors, mut patience) = (Sensors::default(), Patience::seconds(20));
    loop {
        let _ = port.receive(|arrival| {
            if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
                end.receive(&frame, stamp_ns, &mut sensors);
            }
        });
        let speed = sensors.propeller_rate[0];
        if speed.count > 0 && enough(speed.value) {
            return speed.value;
        }
        assert!(patience.lasts(), "the rotor turns at {} rad/s", speed.value);
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Who kills the loop leaves the rotors to their ESCs, which stop them by their own timeout.
fn killed(bench: &TestBench, bus: &Bus) {
    let _emulator = bench.start(&["emulate", "--can", &bus.name, "--json"]);
    let mut run = bench.start(&["run", "--json"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    let mut port = bus.port();
    let flying = rotor_speed(bench, &mut port, |speed| speed > 200.0);
    run.signal(libc::SIGKILL);
    let killed_ns = clock::monotonic_ns();
    run.wait();
    let stopped = rotor_speed(bench, &mut port, |speed| speed < 20.0);
    let took_s = clock::span_s(clock::monotonic_ns() - killed_ns);
    say(&format!("{flying:.0} rad/s, then SIGKILL: {stopped:.1} rad/s after {took_s:.2} s"));
}

/// Another node's command, an identifier of ours, latches the guard.
fn commanded_by_another(bench: &TestBench, bus: &Bus, foreign: &Frame) {
    let _emulator = bench.start(&["emulate", "--can", &bus.name, "--json"]);
    let _run = bench.start(&["run", "--json"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    let at_ns = clock::monotonic_ns();
    bus.port().send(foreign).expect("there is room");
    let latched = watcher.until("a latch", |it| {
        it.stamp_ns > at_ns && it.state == State::FailsafeLatched as u32 && it.rotor == [0.0; 2]
    });
    let cause = Cause::from_code(latched.cause).unwrap_or_default();
    if cause != Cause::ForeignCommand {
        late(format!("latched for another cause: {cause}"));
    }
    bench.judge("another node's command", at_ns, latched.stamp_ns);
}

#[test]
fn two_vescs_fly_and_stop_by_themselves() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("vesc", VESC, &bus.name);
        assert!(bench.run(&["check"]).status.success());
        let summary = fly(&bench, &bus.name, 4.0);
        say(&format!("two VESCs: {}", summary["angle"]));
    });
    up_to_six_times(|| {
        let bus = Bus::new();
        killed(&bench("vesc-killed", VESC, &bus.name), &bus);
    });
    up_to_six_times(|| {
        let bus = Bus::new();
        // SET_DUTY of node 24: the second rotor's.
        let duty = Frame::classic(Id::Extended(24), &[0, 0, 0xC3, 0x50]).expect("short");
        commanded_by_another(&bench("vesc-foreign", VESC, &bus.name), &bus, &duty);
    });
}

#[test]
fn two_odrives_fly_and_stop_by_themselves() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("odrive", ODRIVE, &bus.name);
        assert!(bench.run(&["check"]).status.success());
        let summary = fly(&bench, &bus.name, 4.0);
        say(&format!("two ODrives: {}", summary["angle"]));
    });
    up_to_six_times(|| {
        let bus = Bus::new();
        killed(&bench("odrive-killed", ODRIVE, &bus.name), &bus);
    });
    up_to_six_times(|| {
        let bus = Bus::new();
        // SET_INPUT_VEL (0x00D) of node 17.
        let velocity = Frame::classic(Id::Standard(17 << 5 | 0x0D), &[0; 8]).expect("short");
        commanded_by_another(&bench("odrive-foreign", ODRIVE, &bus.name), &bus, &velocity);
    });
}

/// Two ends of one wire within this kernel: emulator at the one, loop at the other.
#[test]
fn a_bench_flies_over_vxcan() {
    let [near, far] = ["x0", "x1"].map(|end| format!("vx{}{end}", std::process::id()));
    ip(&["link", "add", "dev", &near, "type", "vxcan", "peer", "name", &far]);
    ip(&["link", "set", &near, "up"]);
    ip(&["link", "set", &far, "up"]);
    up_to_six_times(|| {
        let bench = bench("vxcan", VESC, &near);
        let check = String::from_utf8_lossy(&bench.run(&["check"]).stdout).into_owned();
        assert!(check.contains(&format!("bus {near} (up, ")), "{check}");
        let summary = fly(&bench, &far, 3.0);
        say(&format!("over vxcan: {}", summary["angle"]));
    });
    ip(&["link", "delete", &near]);
}

/// Messages of the built-in bench, as long as only CAN FD frames are: the loop's command and the gyro.
#[test]
fn a_bench_flies_in_fd_frames() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("fd.dbc");
    let text = include_str!("../../dbc/bench.dbc");
    let text = text.replace("COMMAND: 8", "COMMAND: 24").replace("GYRO: 8", "GYRO: 12");
    assert!(text.contains("COMMAND: 24") && text.contains("GYRO: 12"));
    std::fs::write(&file, text).expect("written");
    up_to_six_times(|| {
        let bus = Bus::new();
        let mut bench = bench("fd", "bus.fd = true\n", &bus.name);
        bench.config.bus.database[0].file = file.to_str().expect("UTF-8").to_owned();
        std::fs::write(&bench.file, toml::to_string(&bench.config).expect("TOML")).expect("written");
        let mut port = bus.port();
        let mut lengths = std::collections::BTreeMap::new();
        let summary = std::thread::scope(|scope| {
            let flight = scope.spawn(|| fly(&bench, &bus.name, 3.0));
            while !flight.is_finished() {
                let _ = port.receive(|arrival| {
                    if let Arrival::Frame { frame, .. } = arrival {
                        let is_fd = matches!(frame.kind(), FrameKind::Fd { bit_rate_switch: true, .. });
                        *lengths.entry((frame.id().number(), is_fd, frame.length())).or_insert(0) += 1;
                    }
                });
                std::thread::sleep(Duration::from_millis(20));
            }
            flight.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        for message in [(0x010, true, 24), (0x020, true, 12), (0x041, false, 8)] {
            assert!(lengths.get(&message).is_some_and(|count| *count > 10), "{message:?}: {lengths:?}");
        }
        say(&format!("in FD frames: {}", summary["angle"]));
    });
}

/// The two ends of a serial line: what a program writes into the master comes out of the device, and the other way round.
struct Line {
    master: File,
    device: String,
}

impl Line {
    fn open() -> Self {
        // SAFETY: plain calls; the descriptor is nobody else's, and the name is written into a buffer of the length that is said.
        unsafe {
            let fd = libc::posix_openpt(libc::O_RDWR | libc::O_NOCTTY | libc::O_NONBLOCK | libc::O_CLOEXEC);
            assert!(fd >= 0 && libc::grantpt(fd) == 0 && libc::unlockpt(fd) == 0, "a pseudo terminal");
            let mut name = [0_u8; 64];
            assert_eq!(libc::ptsname_r(fd, name.as_mut_ptr().cast(), name.len()), 0);
            let device = name.iter().take_while(|byte| **byte != 0).map(|byte| char::from(*byte)).collect();
            Self { master: File::from_raw_fd(fd), device }
        }
    }
}

/// `slcand`, which stays in front; ended with the value.
struct Slcand(std::process::Child);

impl Slcand {
    fn start(line: &Line, interface: &str) -> Self {
        // S8: 1 Mbit/s, as the bench has it.
        let child = Command::new("slcand").args(["-F", "-o", "-c", "-s8", &line.device, interface]).spawn();
        let mut patience = Patience::seconds(20);
        while InterfaceStatus::find(interface).expect("a kernel with CAN").is_none() {
            assert!(patience.lasts(), "slcand makes no {interface}");
            std::thread::sleep(Duration::from_millis(10));
        }
        ip(&["link", "set", interface, "up"]);
        Self(child.expect("slcand (can-utils) is installed"))
    }
}

impl Drop for Slcand {
    fn drop(&mut self) {
        run("kill", &["-TERM", &self.0.id().to_string()]);
        let _ = self.0.wait();
    }
}

/// Two serial adapters (`slcan`), each at a pseudo terminal, and a wire between them: what one says the other hears.
#[test]
fn a_bench_flies_over_two_serial_adapters() {
    let (one, other) = (Line::open(), Line::open());
    let [near, far] = ["a", "b"].map(|end| format!("slcan{}{end}", std::process::id() % 10_000));
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| wire(&one.master, &other.master, &stop));
        let adapters = (Slcand::start(&one, &near), Slcand::start(&other, &far));
        let flight = std::panic::catch_unwind(|| {
            up_to_six_times(|| {
                let bench = bench("slcan", VESC, &near);
                let summary = fly(&bench, &far, 3.0);
                say(&format!("over two serial adapters: {}", summary["angle"]));
                // By its name it may be a real adapter: nothing arms by itself there.
                let refused = bench.run(&["run", "--arm"]);
                assert_eq!(refused.status.code(), Some(2), "{}", String::from_utf8_lossy(&refused.stderr));
            });
        });
        drop(adapters);
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
        flight.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    });
}

/// Carries bytes from each to the other.
fn wire(one: &File, other: &File, stop: &std::sync::atomic::AtomicBool) {
    let mut bytes = [0; 4096];
    while !stop.load(std::sync::atomic::Ordering::Relaxed) {
        let deadline_ns = clock::monotonic_ns() + 20_000_000;
        let _ = rotorbench::rt::wait([one.as_raw_fd(), other.as_raw_fd()], deadline_ns);
        for (mut from, mut to) in [(one, other), (other, one)] {
            // Nothing there, or nobody at the other end yet: lost, as on a wire.
            if let Ok(count) = from.read(&mut bytes) {
                let _ = to.write_all(&bytes[..count]);
            }
        }
    }
}

/// An interface of another kind is refused in a sentence that says what it is.
#[test]
fn an_interface_that_carries_no_can_is_said_to_be_another_kind() {
    let bench = bench("lo", VESC, "lo");
    for command in
        [&["bridge"][..], &["run"], &["emulate", "--can", "lo"], &["dronecan", "list", "--interface", "lo"]]
    {
        let ended = bench.run(command);
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert_eq!(ended.status.code(), Some(2), "{command:?}: {said}");
        assert!(
            said.contains("no CAN interface: the kernel calls it a network device of kind 772"),
            "{said}"
        );
    }
}
