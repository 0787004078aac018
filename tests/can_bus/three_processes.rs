//! Three processes on a real bus: emulated ESCs and IMU, bridge, controller. The angle is held through torque impulses,
//! and two parties that share no code with the house see it: `candump` and cantools, with `dbc/bench.dbc`.
//!
//! `ROTORBENCH_SOAK_S` makes each run that long, and adds one at 200 Hz; `tools/soak` uses 60.

use std::process::{Command, Stdio};

use rotorbench::emulate::Impulse;
use rotorbench::guard::{Cause, State};
use rotorbench::shm::{BenchMember, ProcessRole, SENSORS, SharedMemoryConfig};

use crate::bus::{Bus, run};
use crate::json_schema;
use crate::processes::{TestBench, late, say, up_to_six_times};

/// What cantools makes of the log: per message the number of frames, of `COMMAND` the range of the commands, of
/// `GYRO` the greatest rate; and every counter must step by one.
const DECODE: &str = r##"
import sys, json, cantools
dbc = cantools.database.load_file(sys.argv[1])
names = {m.frame_id: m for m in dbc.messages}
count, last, jumps, high, low, rate, other = {}, {}, 0, 0.0, 1.0, 0.0, 0
for line in open(sys.argv[2]):
    stamp, _, text = line.split()[:3]
    number, _, data = text.partition("#")
    message = names.get(int(number, 16)) if len(number) == 3 and not data.startswith("#") else None
    payload = bytes.fromhex(data) if message and "R" not in data else b""
    if message is None or len(payload) != message.length:
        other += 1
        continue
    values = message.decode(payload, decode_choices=False)
    count[message.name] = count.get(message.name, 0) + 1
    if message.name == "COMMAND":
        high = max(high, values["rotor_1"], values["rotor_2"])
        if count[message.name] > 100: low = min(low, values["rotor_1"], values["rotor_2"])
        if message.name in last and (last[message.name] + 1) % 256 != values["counter"]: jumps += 1
        last[message.name] = values["counter"]
    if message.name == "GYRO" and abs(values["rate"]) < 40: rate = max(rate, abs(values["rate"]))
print(json.dumps(dict(count=count, jumps=jumps, high=high, rate=rate, other=other)))
"##;

#[test]
fn the_angle_is_held_and_others_see_it() {
    let soak: Option<f64> = std::env::var("ROTORBENCH_SOAK_S").ok().and_then(|it| it.parse().ok());
    let seconds = soak.unwrap_or(6.0);
    // User-Mode Linux, with its one processor and slow system calls, carries three processes and candump at 200 Hz on a
    // quiet machine only: for the long runs.
    let rates: &[f64] = if soak.is_some() { &[50.0, 200.0] } else { &[50.0] };
    for &rate_hz in rates {
        up_to_six_times(|| hold(rate_hz, seconds));
    }
}

fn hold(rate_hz: f64, seconds: f64) {
    let bus = Bus::new();
    let bench = TestBench::new("three", |config| {
        config.period_s = 1.0 / rate_hz;
        config.bus.interface.clone_from(&bus.name);
        config.emulator.impulse = vec![
            Impulse { at_s: 1.0, duration_s: 0.05, torque: 0.6 },
            Impulse { at_s: 3.0, duration_s: 0.05, torque: -0.6 },
        ];
        config.emulator.impulse_period_s = 4.0;
        // This test is about holding, not about reacting: on one emulated processor, starting `cansend` alone may
        // stop everything for longer than the built-in hold.
        config.guard.hold_s = 0.5;
        config.real_time.lock_memory = false;
        config.emulator.esc_timeout_s = Some(1.0);
    });
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("bus.log");
    // Once before the run, so that it is in memory.
    run("cansend", &[&bus.name, "7DF#R"]);
    let mut candump = Command::new("candump")
        // Room for the whole run: it has no priority over what it listens to. It says what it lost all the same.
        .args(["-L", "-d", "-r", "16000000", &bus.name])
        .stdout(std::fs::File::create(&log).expect("created"))
        .stderr(Stdio::null())
        .spawn()
        .expect("candump (can-utils) is installed");
    let length = format!("{}", seconds + 20.0);
    let mut emulator = bench.start(&["emulate", "--can", &bus.name, "--seconds", &length, "--json"]);
    let mut bridge = bench.start(&["bridge", "--json"]);
    let mut control = bench.start(&["control", "--seconds", &length, "--json"]);
    let mut watcher = bench.watch();
    bench.arm_and_wait(&mut watcher);
    let member = BenchMember::join(&bench.config.name, &SharedMemoryConfig::default(), ProcessRole::Monitor)
        .expect("joined");
    let mut sensors = member.subscribe(&SENSORS).expect("subscribed");
    // Garbage from a third program, with and without the sensors' ids, while it runs: not a number, and a million rad/s.
    for frame in [
        "123#DEADBEEF",
        "020#01",
        "041#0102030405060708",
        "020#00000000FFFFFFFF",
        "020#0014000000247449",
        "1FFFFFFF#00",
        "7DF#R",
    ] {
        run("cansend", &[&bus.name, frame]);
    }
    let mut highest = 0.0_f64;
    let end = std::time::Instant::now() + std::time::Duration::from_secs_f64(seconds);
    while std::time::Instant::now() < end {
        watcher.each(|applied| highest = applied.rotor.into_iter().fold(highest, f64::max));
        while let Some(sensors) = sensors.next_in_order() {
            let rate = sensors.body_rate.value;
            assert!(rate.abs() < 40.0, "a controller got {rate} rad/s");
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let state = State::from_code(watcher.newest.state).unwrap_or_default();
    if !state.is_active() {
        // What only a process that was held up gives.
        let causes = [
            Cause::TooManyMisses,
            Cause::CommandAnswersOldSensors,
            Cause::CommandMissing,
            Cause::SignalStale,
        ];
        let cause = Cause::from_code(watcher.newest.cause).unwrap_or_default();
        assert!(causes.contains(&cause), "it ran to the end, and is {state}: {:?}", watcher.said);
        late(format!("it ran to the end, and is {state}: {cause}"));
    }
    assert!(highest <= bench.config.guard.rotor_maximum);
    assert!(bench.run(&["disarm"]).status.success(), "the operator ends the run");
    for process in [&mut control, &mut emulator, &mut bridge] {
        process.signal(libc::SIGTERM);
        assert!(process.wait().success());
    }
    // Asked to end rather than killed, so that it writes what it still holds.
    run("kill", &["-TERM", &candump.id().to_string()]);
    let _ = candump.wait();

    let control = json_schema::answer("control", control.output());
    let emulator = json_schema::answer("emulate-can", emulator.output());
    let bridge = json_schema::answer("bridge", bridge.output());
    let greatest = control["angle"]["greatest"].as_f64().expect("a number");
    let held = control["angle"]["count"].as_f64().expect("a number");
    // Unheld, an impulse of 0.6 N m for 50 ms would turn the body past 0.5 rad in half a second; and a controller that
    // was held up for so long has not held it.
    if held <= seconds * rate_hz * 0.8 || greatest >= 0.5 {
        late(format!("{held} periods, angle error up to {greatest}: {control:#}"));
    }
    assert!(greatest > 0.02, "the impulses were felt: {control:#}");
    // What the controller believes is one thing, the body another.
    let turned = emulator["body"]["angle_peak_rad"].as_f64().expect("a number");
    if turned >= 0.3 {
        late(format!("the body turned by {turned} rad"));
    }
    let decoded = &bridge["bus"]["decoded"];
    assert!(
        decoded["wrong_length"].as_u64() >= Some(1) && decoded["unknown_id"].as_u64() >= Some(3),
        "{decoded}"
    );
    // The gyro's two are refused for whatever is found first: their counter, if that does not fit.
    let refused = |cause: &str| decoded[cause].as_u64().expect("a number");
    assert!(refused("not_a_number") + refused("out_of_range") + refused("counter") >= 2, "{decoded}");
    let dbc = concat!(env!("CARGO_MANIFEST_DIR"), "/dbc/bench.dbc");
    let text = std::fs::read_to_string(&log).expect("readable");
    if let Some(dropped) = text.lines().find(|it| it.contains("DROPCOUNT")) {
        late(format!("candump was held up: {dropped}"));
    }
    let log = log.to_str().expect("UTF-8");
    let seen = Command::new("python3").args(["-c", DECODE, dbc, log]).output().expect("python3 is installed");
    assert!(seen.status.success(), "{}", String::from_utf8_lossy(&seen.stderr));
    let seen: serde_json::Value = serde_json::from_slice(&seen.stdout).expect("JSON");
    let commands = seen["count"]["COMMAND"].as_f64().expect("cantools saw commands");
    let sent = bridge["bus"]["port"]["sent"].as_f64().expect("a number");
    assert!((commands - sent).abs() <= 2.0, "cantools saw {commands} of the {sent} commands");
    // The garbage with the command's id has the wrong length; no other frame of that id is there to break the count.
    assert_eq!(seen["jumps"].as_u64(), Some(0), "{seen}");
    // On the bus from the spin-up on, in shared memory from the armed run on; one step of the frame is 0.00002.
    let high = seen["high"].as_f64().expect("a number");
    assert!(high + 0.001 > highest && high <= bench.config.guard.rotor_maximum + 0.001, "{seen}, {highest}");
    say(&format!(
        "{rate_hz} Hz, {seconds} s, three processes: angle error rms {:.4}, greatest {greatest:.4} rad (body {:.4}); {} of \
         {} control slots run, late p99 {:.0} µs; candump and cantools saw {commands} commands, {} gyro frames, not taken: {decoded}",
        control["angle"]["rms"].as_f64().or(emulator["body"]["angle_rms_rad"].as_f64()).unwrap_or(f64::NAN),
        emulator["body"]["angle_peak_rad"].as_f64().unwrap_or(f64::NAN),
        control["timing"]["run"],
        control["timing"]["slots"],
        control["timing"]["lateness"]["p99_us"].as_f64().unwrap_or(f64::NAN),
        seen["count"]["GYRO"],
    ));
}
