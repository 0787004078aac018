//! An exported log in the hands of two parties that share no code with the house: `canplayer` (can-utils) plays it onto a bus,
//! and python-can reads it.

use std::path::Path;
use std::process::Command;

use rotorbench::can::{Arrival, Frame, FrameKind, Id};
use rotorbench::recording::{RawFrame, Recorder, RecorderOptions, Recording, RecordingMetadata};

use crate::bus::{Bus, receive, run};
use crate::processes::say;

/// What python-can makes of the log: one line a frame, as [`as_read`] writes it.
const READ: &str = r##"
import sys, can
for m in can.LogReader(sys.argv[1]):
    flags = [m.is_extended_id, m.is_remote_frame, m.is_error_frame, m.is_fd, m.bitrate_switch, m.error_state_indicator]
    print(f"{m.timestamp:.6f} {m.channel} {m.arbitration_id:X} {''.join(str(int(f)) for f in flags)} {m.dlc} {m.data.hex()}")
"##;

fn frames() -> Vec<Frame> {
    let fd = |bit_rate_switch, error_state| FrameKind::Fd { bit_rate_switch, error_state };
    let long: Vec<u8> = (0..64).collect();
    let frame = |id, kind, data: &[u8]| Frame::new(id, kind, data).expect("fits");
    vec![
        frame(Id::Standard(0x117), FrameKind::Classic, &[0, 0, 0xC7, 0x38]),
        // The same number in 29 bits is another frame.
        frame(Id::Extended(0x117), FrameKind::Classic, &[0, 0, 0xC7, 0x38, 1, 2, 3, 4]),
        frame(Id::Extended(0x1FFF_FFFF), FrameKind::Classic, &[]),
        Frame::remote(Id::Standard(0x123), 4).expect("fits"),
        Frame::remote(Id::Extended(7), 0).expect("fits"),
        frame(Id::Standard(0x7FF), fd(false, false), &[0xA5; 12]),
        frame(Id::Extended(0x1234_5678), fd(true, false), &long),
        frame(Id::Standard(1), fd(true, true), &[9]),
    ]
}

/// A frame as python-can should have read it.
fn as_read(frame: &Frame, microseconds: u64, interface: &str) -> String {
    let (extended, is_remote) = (frame.id().is_extended(), frame.kind() == FrameKind::Remote);
    let (fd, brs, esi) = match frame.kind() {
        FrameKind::Fd { bit_rate_switch, error_state } => (true, bit_rate_switch, error_state),
        FrameKind::Classic | FrameKind::Remote => (false, false, false),
    };
    let flags: String =
        [extended, is_remote, false, fd, brs, esi].map(|it| if it { '1' } else { '0' }).iter().collect();
    let data: String = if is_remote {
        String::new()
    } else {
        frame.data().iter().map(|byte| format!("{byte:02x}")).collect()
    };
    let stamp = format!("{}.{:06}", microseconds / 1_000_000, microseconds % 1_000_000);
    format!("{stamp} {interface} {:X} {flags} {} {data}", frame.id().number(), frame.length())
        .trim_end()
        .to_owned()
}

/// The frames, a millisecond apart, recorded and exported by the program; [µs] since 1970 of the recording's beginning.
fn export(frames: &[Frame], log: &Path, folder: &Path) -> u64 {
    let recording = folder.join("run.mcap");
    let metadata = RecordingMetadata { interface: "can0".to_owned(), ..RecordingMetadata::default() };
    let recorder = Recorder::start(&recording, &metadata, RecorderOptions::default()).expect("a new file");
    let mut sender = recorder.sender();
    for (frame, stamp_ns) in frames.iter().zip((1..).map(|it| it * 1_000_000)) {
        assert!(sender.send(RawFrame::new(frame, stamp_ns, None, false)));
    }
    recorder.finish().expect("the disk works");
    let program = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args(["export".as_ref(), recording.as_os_str(), "--candump".as_ref(), log.as_os_str()])
        .output()
        .expect("the program starts");
    assert!(program.status.success(), "{}", String::from_utf8_lossy(&program.stderr));
    Recording::open(&recording).expect("a recording").metadata().wall_ns(0) / 1000
}

#[test]
fn an_exported_log_is_played_by_canplayer_and_read_by_python_can() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("run.log");
    let frames = frames();
    let began_us = export(&frames, &log, folder.path());
    let path = log.to_str().expect("UTF-8");

    let read = Command::new("python3").args(["-c", READ, path]).output().expect("python3 is installed");
    assert!(read.status.success(), "python-can: {}", String::from_utf8_lossy(&read.stderr));
    let read = String::from_utf8_lossy(&read.stdout).into_owned();
    let wanted = frames.iter().zip(1..).map(|(frame, at)| as_read(frame, began_us + 1000 * at, "can0"));
    assert_eq!(read.lines().map(str::trim_end).collect::<Vec<_>>(), wanted.collect::<Vec<_>>());

    let bus = Bus::new();
    let mut port = bus.port();
    run("canplayer", &["-I", path, &format!("{}=can0", bus.name)]);
    let played: Vec<Frame> = receive(&mut port, |arrivals| arrivals.len() == frames.len())
        .into_iter()
        .map(|arrival| match arrival {
            Arrival::Frame { frame, .. } => frame,
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(played, frames);
    say(&format!("an exported log of {} frames: played by canplayer, read by python-can", frames.len()));
}
