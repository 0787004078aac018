//! Captures of the bus: written for others to read, and read back into a log.

use std::path::Path;

use rotorbench::can::{BusConfig, Protocol, Roles};
use rotorbench::log::{can_capture, candump, export};
use rotorbench::recording::{RawFrame, Recorder, RecorderOptions, Recording, RecordingMetadata};
use rotorbench::signal::{Applied, Sample, Sensors};

/// What a recording of these frames must export, to the letter: read by canplayer (can-utils) and python-can.
const GOLDEN: [&str; 5] = [
    "117#0000C738",
    "00000117#0000C738",
    "123#R4",
    "120##5112233445566778899AABBCC",
    "20000004#000C000000000000",
];

fn golden_frames() -> Vec<RawFrame> {
    GOLDEN
        .iter()
        .enumerate()
        .map(|(index, body)| {
            let line = format!("(1000000000.000000) vcan0 {body}");
            let frame = candump::parse(&line).expect("a line").frame;
            RawFrame { stamp_ns: 1_000_000 * (index as u64 + 1), ..frame }
        })
        .collect()
}

#[test]
fn raw_frames_leave_as_candump_writes_them_by_their_stamps() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, log) = (folder.path().join("run.mcap"), folder.path().join("run.log"));
    let metadata = RecordingMetadata { interface: "vcan0".to_owned(), ..RecordingMetadata::default() };
    let recorder = Recorder::start(&path, &metadata, RecorderOptions::default()).expect("a new file");
    let (mut first, mut second) = (recorder.sender(), recorder.sender());
    // Two threads: their frames come in another order than they were on the bus.
    for (index, frame) in golden_frames().into_iter().enumerate().rev() {
        assert!(if index % 2 == 0 { first.send(frame) } else { second.send(frame) });
    }
    recorder.finish().expect("the disk works");
    let summary = export::write_candump(&path, &log).expect("exported");
    assert_eq!(summary.written, 5);
    let wall = Recording::open(&path).expect("a recording").metadata().wall_ns(0);
    let expected: Vec<String> = GOLDEN
        .iter()
        .enumerate()
        .map(|(index, body)| {
            let microseconds = (wall + 1_000_000 * (index as u64 + 1)) / 1000;
            format!("({}.{:06}) vcan0 {body}", microseconds / 1_000_000, microseconds % 1_000_000)
        })
        .collect();
    assert_eq!(std::fs::read_to_string(&log).expect("text").lines().collect::<Vec<_>>(), expected);
    for (read, frame) in candump::read(&log).expect("our own log").iter().zip(golden_frames()) {
        assert_eq!(RawFrame { stamp_ns: 0, ..read.frame }, RawFrame { stamp_ns: 0, ..frame });
    }
}

/// Frames of a bench for `periods` of 20 ms, as the bus would carry them.
fn bus_log(roles: &Roles, periods: u64) -> String {
    let (mut sensor_sender, mut command_sender) = (roles.sensor_sender(), roles.command_sender());
    let mut text = String::new();
    let mut line = |frame: &rotorbench::can::Frame, microseconds: u64| {
        let raw = RawFrame::new(frame, 0, None, false);
        let wall_ns = 1_700_000_000_000_000_000 + microseconds * 1000;
        text += &(candump::emit(&raw, wall_ns, "can0").expect("it fits") + "\n");
    };
    for period in 0..periods {
        let start = period * 20_000;
        let value = |value: f64| Sample::good(value, 1, 1);
        let sensors = Sensors {
            body_rate: value((period as f64 * 0.1).sin()),
            battery_voltage: value(14.8),
            propeller_rate: [value(600.0 + period as f64), value(610.0)],
            ..Sensors::default()
        };
        for index in 0..roles.sensor_messages().len() {
            if let Some(frame) = roles.encode_sensors(&mut sensor_sender, index, &sensors) {
                line(&frame, start + 100 * index as u64);
            }
        }
        let applied = Applied { rotor: [0.25, 0.5], ..Applied::default() };
        for frame in roles.encode_commands(&mut command_sender, &applied).iter() {
            line(frame, start + 1000);
        }
    }
    text
}

#[test]
fn a_candump_log_becomes_a_log_through_dbc_and_roles() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bus.log");
    let roles = Roles::build(&BusConfig::default(), 0.02).expect("the built-in bench");
    std::fs::write(&path, bus_log(&roles, 50)).expect("written");
    let (log, notes) = can_capture::read(&path, &roles, None).expect("understood");
    assert_eq!(notes.rows_by, "command");
    assert_eq!((log.len(), notes.out_of_order), (50, 0));
    assert_eq!(log.time()[1], 0.02);
    assert!(log.holes().is_empty());
    let near = |name: &str, row: usize, value: f64, step: f64| {
        let found = log.column(name).expect(name)[row];
        // The bus carries whole steps of the DBC file's scale.
        assert!((found - value).abs() <= step, "{name}: {found} for {value}");
    };
    near("command_1", 7, 0.25, 1e-3);
    near("command_2", 7, 0.5, 1e-3);
    near("body_rate_rad_s", 7, 0.7_f64.sin(), 5e-3);
    near("propeller_rate_1_rad_s", 7, 607.0, 0.5);
    near("battery_voltage_v", 7, 14.8, 0.05);

    let none = can_capture::read(&path, &roles, Some("can9")).expect_err("no frame of that interface");
    assert!(none.to_string().contains("carries a signal"), "{none}");
    std::fs::write(&path, "(1735270496.916858) can0 110#00\nnonsense\n").expect("written");
    let wrong = can_capture::read(&path, &roles, None).expect_err("line 2").to_string();
    assert!(wrong.contains("bus.log, line 2: "), "{wrong}");
}

/// VESC's `STATUS_5` has its voltage in bytes 4 and 5, and two more that say nothing, which some senders leave out.
#[test]
fn a_shorter_frame_is_read_from_a_capture_if_it_holds_the_signal_and_never_from_a_bus() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bus.log");
    let bench = "[[database]]\nfile = \"vesc\"\nnode_mask = 0xFF\n\
        [sensors]\nbattery_voltage = { signal = \"STATUS_5.input_voltage\", node = 23 }\n\
        [commands]\nrotor_1 = { signal = \"SET_DUTY.duty\", node = 23 }\n\
        rotor_2 = { signal = \"SET_DUTY.duty\", node = 24 }\n";
    let roles = Roles::build(&toml::from_str(bench).expect("a bus"), 0.01).expect("a bench");
    // 12.3 V in frames of eight, seven, six and five bytes, 10 ms apart, and CAN FD's of twelve.
    let payloads =
        ["000003E8007B0000", "000003E8007B00", "000003E8007B", "000003E800", "##1000003E8007B000000000000"];
    let mut text = String::new();
    for (index, payload) in payloads.iter().enumerate() {
        let hash = if payload.starts_with('#') { "" } else { "#" };
        text += &format!("(100.{:06}) can0 00001B17{hash}{payload}\n", 10_000 * index);
    }
    std::fs::write(&path, text).expect("written");
    let (log, notes) = can_capture::read(&path, &roles, None).expect("understood");
    assert_eq!(notes.rows_by, "battery_voltage");
    assert_eq!(log.column("battery_voltage_v").expect("read"), [12.3; 3]);
    assert_eq!((notes.sensors.accepted, notes.sensors.wrong_length), (3, 2));

    let mut on_bus = roles.bridge_end();
    for frame in candump::read(&path).expect("a log") {
        on_bus.receive(&frame.frame.frame().expect("a frame"), 1, &mut Sensors::default());
    }
    assert_eq!((on_bus.counts().accepted, on_bus.counts().wrong_length), (1, 4));
}

/// The frames of a candump log as Vector's text has them.
fn as_asc(frames: &[candump::CandumpFrame], start_ns: u64) -> String {
    let mut text = "date Tue Nov 14 22:13:20.000 2023\nbase hex  timestamps absolute\n".to_owned();
    for frame in frames.iter().map(|it| it.frame) {
        let data: String = frame.payload().iter().map(|byte| format!(" {byte:02X}")).collect();
        let microseconds = (frame.stamp_ns - start_ns) / 1000;
        let (seconds, rest) = (microseconds / 1_000_000, microseconds % 1_000_000);
        text += &format!("{seconds:4}.{rest:06} 1  {:X}  Rx   d {}{data}\n", frame.id, frame.length);
    }
    text
}

/// The frames of a candump log as Vector's binary log has them, in containers of 1,000 bytes.
fn as_blf(frames: &[candump::CandumpFrame], start_ns: u64) -> Vec<u8> {
    let object = |kind: u32, body: &[u8]| {
        let size = 16 + body.len() as u32;
        [&b"LOBJ\x10\0\x01\0"[..], &size.to_le_bytes(), &kind.to_le_bytes(), body].concat()
    };
    let mut whole = Vec::new();
    for frame in frames.iter().map(|it| it.frame) {
        let stamp = (frame.stamp_ns - start_ns).to_le_bytes();
        let head = [1, 0, 0, frame.length];
        let data = &frame.data[..8];
        let body = [&[2, 0, 0, 0, 0, 0, 0, 0][..], &stamp, &head, &frame.id.to_le_bytes(), data].concat();
        whole.extend(object(1, &body));
    }
    let mut bytes = b"LOGG\x90\0\0\0".to_vec();
    bytes.resize(144, 0);
    for part in whole.chunks(1000) {
        let size = part.len() as u32;
        bytes.extend(object(10, &[&[0; 8][..], &size.to_le_bytes(), &[0; 4], part].concat()));
        bytes.extend(vec![0; part.len() % 4]);
    }
    bytes
}

#[test]
fn captures_of_all_formats_become_the_same_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let roles = Roles::build(&BusConfig::default(), 0.02).expect("the built-in bench");
    std::fs::write(path("bus.log"), bus_log(&roles, 50)).expect("written");
    let frames = candump::read(&path("bus.log")).expect("our own log");
    let start_ns = frames[0].frame.stamp_ns;
    std::fs::write(path("bus.asc"), as_asc(&frames, start_ns)).expect("written");
    std::fs::write(path("bus.blf"), as_blf(&frames, start_ns)).expect("written");
    let (candump, _) = can_capture::read(&path("bus.log"), &roles, None).expect("understood");
    for name in ["bus.asc", "bus.blf"] {
        let (log, notes) = can_capture::read(&path(name), &roles, Some("1")).expect("understood");
        assert_eq!((log.len(), notes.skipped.len(), notes.rows_by.as_str()), (50, 0, "command"), "{name}");
        assert_eq!(log.time(), candump.time(), "{name}");
        for column in
            ["command_1", "command_2", "body_rate_rad_s", "propeller_rate_1_rad_s", "battery_voltage_v"]
        {
            let (ours, theirs) = (log.column(column).expect(column), candump.column(column).expect(column));
            let same = ours.iter().zip(theirs).all(|(ours, theirs)| ours.to_bits() == theirs.to_bits());
            assert!(same, "{name}, {column}");
        }
        let none = can_capture::read(&path(name), &roles, Some("2")).expect_err("nothing on that channel");
        assert!(none.to_string().contains("carries a signal"), "{none}");
    }
}

#[test]
fn import_tells_the_kinds_of_log_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, csv) = (folder.path().join("bus.log"), folder.path().join("bus.csv"));
    let roles = Roles::build(&BusConfig::default(), 0.02).expect("the built-in bench");
    std::fs::write(&path, bus_log(&roles, 50)).expect("written");
    let text = |path: &Path| path.display().to_string();
    let done = super::rotorbench(&["import", &text(&path), "-o", &text(&csv), "--json"]);
    let report: serde_json::Value = super::json_schema::answer("import", &done.stdout);
    assert_eq!(report["frames"]["rows_by"], "command");
    assert_eq!(report["findings"]["samples"], 50);
    let again = super::rotorbench(&["import", &text(&csv), "--json"]);
    let report: serde_json::Value = super::json_schema::answer("import", &again.stdout);
    assert_eq!(report["findings"]["samples"], 50);
    assert!(report["frames"].is_null());
}
