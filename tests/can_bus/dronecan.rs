//! A bench on DroneCAN as processes on a real bus: emulated nodes and the loop, while DroneCAN's reference implementation in
//! Python, a node of its own, reads along and asks each node what it is.
//!
//! `ROTORBENCH_SOAK_S` makes the run that long, and adds one at 200 Hz; as in `three_processes`.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use rotorbench::bench::BenchConfig;
use rotorbench::can::{Frame, Id};
use rotorbench::clock;
use rotorbench::emulate::Impulse;
use rotorbench::guard::{Cause, State};

use crate::bus::{Bus, run as run_program};
use crate::processes::reference::python;
use crate::processes::{TestBench, late, say, up_to_six_times};

/// What the reference sees until it is asked to end: each node's health, mode and name; transfers by type; what arming said; the
/// greatest raw command and speed, and how many transfers came in FD frames. With a second argument it speaks in FD frames itself.
const READ_ALONG: &str = r##"
import json, signal, sys, dronecan
from dronecan.app.node_monitor import NodeMonitor
node = dronecan.make_node(sys.argv[1], node_id=126, bitrate=1000000)
node.set_canfd(len(sys.argv) > 2)
monitor, seen = NodeMonitor(node), dict(counts={}, arming=[], raw=0, rpm=0, voltage=0, foreign=0, fd=0)
def handler(event):
    name = dronecan.get_dronecan_data_type(event.message).full_name
    seen["counts"][name] = seen["counts"].get(name, 0) + 1
    seen["fd"] += event.transfer.canfd
    if name.endswith("ArmingStatus") and event.message.status not in seen["arming"]: seen["arming"].append(event.message.status)
    if name.endswith("RawCommand"):
        seen["raw"] = max([seen["raw"], *event.message.cmd])
        seen["foreign"] += event.transfer.source_node_id != 100
    if name.endswith("esc.Status"): seen["rpm"] = max(seen["rpm"], event.message.rpm)
    if name.endswith("BatteryInfo"): seen["voltage"] = event.message.voltage
for name in ("equipment.esc.RawCommand", "equipment.esc.Status", "equipment.esc.StatusExtended", "equipment.ahrs.RawIMU",
             "equipment.power.BatteryInfo", "equipment.safety.ArmingStatus", "protocol.NodeStatus"):
    node.add_handler(dronecan.TYPENAMES["uavcan." + name], handler)
ended = []
signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
print("listening", flush=True)
while not ended:
    try: node.spin(0.05)
    except dronecan.UAVCANException as error: seen["error"] = str(error)
seen["nodes"] = {}
for id in range(1, 126):
    if monitor.exists(id):
        entry = monitor.get(id)
        name = entry.info.name.decode() if entry.info else None
        seen["nodes"][id] = [int(entry.status.health), int(entry.status.mode), name]
print(json.dumps(seen))
"##;

/// The reference, as long as the value.
struct Reader(Child);

impl Drop for Reader {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The bench of `examples/benches/dronecan.toml` on a bus of the test's own.
pub fn bench(test: &str, bus: &Bus, rate_hz: f64) -> TestBench {
    bench_in_frames(test, bus, rate_hz, false)
}

/// The same, in FD frames or not.
fn bench_in_frames(test: &str, bus: &Bus, rate_hz: f64, fd: bool) -> TestBench {
    let template = include_str!("../../examples/benches/dronecan.toml");
    TestBench::new(test, |config| {
        let name = std::mem::take(&mut config.name);
        *config = BenchConfig::parse(template, Path::new("dronecan.toml")).expect("valid");
        config.name = name;
        config.period_s = 1.0 / rate_hz;
        config.bus.interface.clone_from(&bus.name);
        config.bus.fd = fd;
        config.emulator.impulse = vec![Impulse { at_s: 1.0, duration_s: 0.05, torque: 0.6 }];
        config.emulator.impulse_period_s = 4.0;
        // See `three_processes`: on one emulated processor, starting a program may stop everything for that long.
        config.guard.hold_s = 0.5;
        config.guard.rotor_maximum = 0.8;
        config.real_time.lock_memory = false;
        config.emulator.esc_timeout_s = Some(1.0);
    })
}

#[test]
fn the_loop_runs_and_the_reference_sees_every_node_healthy() {
    run_loops(false);
}

/// The same in CAN FD frames, which the reference reads and sends.
#[test]
fn the_loop_runs_in_fd_frames_and_the_reference_sees_every_node_healthy() {
    run_loops(true);
}

fn run_loops(fd: bool) {
    let soak: Option<f64> = std::env::var("ROTORBENCH_SOAK_S").ok().and_then(|it| it.parse().ok());
    let rates: &[f64] = if soak.is_some() { &[50.0, 200.0] } else { &[50.0] };
    for &rate_hz in rates {
        up_to_six_times(|| run_loop(rate_hz, soak.unwrap_or(6.0), fd));
    }
}

fn run_loop(rate_hz: f64, seconds: f64, fd: bool) {
    let bus = Bus::new();
    let bench = bench_in_frames("dronecan", &bus, rate_hz, fd);
    // Before the flight: while Python starts, one emulated processor does nothing else.
    let reader = Command::new(python())
        .args(["-c", READ_ALONG, &bus.name])
        .args(fd.then_some("fd"))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut reader = Reader(reader.expect("Python runs"));
    let mut said = BufReader::new(reader.0.stdout.take().expect("piped"));
    let mut first = String::new();
    said.read_line(&mut first).expect("text");
    assert_eq!(first.trim(), "listening", "the reference is on the bus");
    let mut emulator = bench.start(&["emulate", "--can", &bus.name, "--json"]);
    let mut run = bench.start(&["run", "--json"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    let end = std::time::Instant::now() + std::time::Duration::from_secs_f64(seconds);
    while std::time::Instant::now() < end {
        watcher.each(|_| {});
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let state = State::from_code(watcher.newest.state).unwrap_or_default();
    if !state.is_active() {
        let cause = Cause::from_code(watcher.newest.cause).unwrap_or_default();
        let held_up = [
            Cause::TooManyMisses,
            Cause::CommandMissing,
            Cause::SignalStale,
            Cause::CommandAnswersOldSensors,
        ];
        assert!(held_up.contains(&cause), "it ran to the end, and is {state}: {:?}", watcher.said);
        late(format!("it ran to the end, and is {state}: {cause}"));
    }
    run_program("kill", &["-TERM", &reader.0.id().to_string()]);
    let mut seen = String::new();
    said.read_to_string(&mut seen).expect("text");
    drop(reader);
    assert!(bench.run(&["disarm"]).status.success(), "the operator ends the run");
    for process in [&mut run, &mut emulator] {
        process.signal(libc::SIGTERM);
        assert!(process.wait().success());
    }
    let seen: serde_json::Value = serde_json::from_str(&seen).expect("JSON of the reference");
    say(&format!("what the reference saw: {seen}"));
    let nodes = seen["nodes"].as_object().expect("nodes");
    let names =
        [("100", "bridge"), ("20", "emulated"), ("21", "emulated"), ("30", "emulated"), ("31", "emulated")];
    for (id, name) in names {
        let [health, mode, found] =
            ["0", "1", "2"].map(|at| &nodes[id][at.parse::<usize>().expect("a number")]);
        assert_eq!((health.as_u64(), mode.as_u64()), (Some(0), Some(0)), "node {id}: {seen}");
        if found.is_null() {
            late(format!("node {id} did not say in time what it is"));
        }
        assert_eq!(found.as_str(), Some(format!("org.rotorbench.{name}").as_str()), "node {id}");
    }
    assert_eq!(nodes.len(), names.len(), "{seen}");
    let count = |name: &str| seen["counts"][format!("uavcan.{name}")].as_u64().unwrap_or(0) as f64;
    // Held up, it may miss some; what it read was whole.
    for (name, each_s) in [
        ("equipment.esc.RawCommand", rate_hz),
        ("equipment.esc.Status", 2.0 * rate_hz),
        ("equipment.ahrs.RawIMU", rate_hz),
        ("equipment.power.BatteryInfo", 5.0),
        ("equipment.esc.StatusExtended", 20.0),
    ] {
        if count(name) < 0.5 * seconds * each_s {
            late(format!("{name} came {} times in {seconds} s", count(name)));
        }
    }
    assert_eq!(seen["foreign"], 0);
    let all: u64 = seen["counts"].as_object().expect("counts").values().filter_map(|it| it.as_u64()).sum();
    assert_eq!(seen["fd"].as_u64(), Some(if fd { all } else { 0 }), "{seen}");
    let frames = if fd { "CAN FD" } else { "CAN 2.0" };
    say(&format!(
        "DroneCAN at {rate_hz} Hz in {frames} frames, {seconds} s: the reference read {all} transfers whole and found {} nodes healthy",
        nodes.len()
    ));
    let arming: Vec<u64> =
        seen["arming"].as_array().expect("a list").iter().filter_map(|it| it.as_u64()).collect();
    assert!(arming.contains(&255) && arming.iter().all(|it| [0, 255].contains(it)), "{seen}");
    let greatest = seen["raw"].as_f64().expect("a number");
    assert!(greatest > 500.0 && greatest <= 0.8 * 8191.0 + 0.5, "{seen}");
    assert!(seen["rpm"].as_f64().is_some_and(|rpm| rpm > 500.0), "{seen}");
    assert!(seen["voltage"].as_f64().is_some_and(|volt| (9.0..14.0).contains(&volt)), "{seen}");
    let json: serde_json::Value = serde_json::from_str(&run.output()).expect("JSON");
    let decoded = &json["bus"]["decoded"];
    for cause in ["checksum", "toggle", "not_a_number", "out_of_range", "foreign_command", "other_node"] {
        assert_eq!(decoded[cause].as_u64().unwrap_or(0), 0, "{cause}: {decoded}");
    }
}

/// Another node that commands the rotors, in one frame, latches the guard: the rotors stop, and the ESCs are told so.
#[test]
fn a_raw_command_of_another_node_latches_the_guard() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("dronecan-foreign", &bus, 50.0);
        let mut emulator = bench.start(&["emulate", "--can", &bus.name, "--json"]);
        let mut run = bench.start(&["run", "--json"]);
        let mut watcher = bench.watch();
        bench.arm_and_wait(&mut watcher);
        // A command for one ESC, the second bench's: index 0 is ours, too.
        let id = Id::new(0x0804_0607, true).expect("29 bits");
        let frame = Frame::classic(id, &[0x10, 0x00, 0xC0]).expect("short");
        let at_ns = clock::monotonic_ns();
        bus.port().send(&frame).expect("there is room");
        let latched = watcher.until("a latch", |it| {
            it.stamp_ns > at_ns && it.state == State::FailsafeLatched as u32 && it.rotor == [0.0; 2]
        });
        assert_eq!(latched.cause, Cause::ForeignCommand as u32, "{:?}", watcher.said);
        bench.judge("another node's RawCommand", at_ns, latched.stamp_ns);
        for process in [&mut run, &mut emulator] {
            process.signal(libc::SIGTERM);
            assert!(process.wait().success());
        }
    });
}
