//! Recordings: written, cut off, damaged, on disks that are slow or full, and read back bit for bit.

use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rotorbench::recording::{
    Disk, End, FrameFlags, RawFrame, RecordedItem, Recorder, RecorderOptions, Recording, RecordingMetadata,
};
use rotorbench::rt::Shutdown;
use rotorbench::signal::{
    Applied, Command, ControlStep, CycleSample, GuardEvent, GuardStep, Heartbeat, Request, Sample, Sensors,
};

const ODD_NAN: u64 = 0x7ff8_0000_dead_beef;

fn sensors(sequence: u64) -> Sensors {
    let stamp_ns = sequence * 1_000_000;
    Sensors {
        sequence,
        stamp_ns,
        body_rate: Sample::good((sequence as f64).sin(), stamp_ns, sequence as u32),
        body_angle: Sample::good(f64::from_bits(ODD_NAN), stamp_ns, sequence as u32),
        ..Sensors::default()
    }
}

fn command(sequence: u64) -> Command {
    Command {
        sequence,
        stamp_ns: sequence * 1_000_000,
        rotor: [0.1, -0.0],
        torque: 1e-310,
        ..Command::default()
    }
}

fn applied(sequence: u64) -> Applied {
    Applied { sequence, stamp_ns: sequence * 1_000_000, rotor: [0.5, 0.25], ..Applied::default() }
}

/// One period of a bench: what its threads would send.
fn period(sequence: u64) -> Vec<RecordedItem> {
    let (seen, wanted, sent) = (sensors(sequence), command(sequence), applied(sequence));
    let control = ControlStep { sensors: seen, applied: applied(sequence - 1), command: wanted };
    let request = Request { sequence: 1, stamp_ns: 5, act: 1, reserved: 0 };
    let request = (sequence == 3).then_some(&request);
    vec![
        seen.into(),
        control.into(),
        GuardStep::new(sequence * 1_000_000 + 7, &seen, Some(&wanted), request, &sent)
            .tripped((sequence == 5).then_some((6, 7)))
            .into(),
        CycleSample { slot: sequence, finished_ns: sequence * 1_000_000, ..CycleSample::default() }.into(),
    ]
}

fn metadata() -> RecordingMetadata {
    RecordingMetadata {
        process: "test".to_owned(),
        bench: "name = \"bench\"\n".to_owned(),
        seeds: [("emulator".to_owned(), u64::MAX)].into(),
        dbc_files: [("bench.dbc".to_owned(), "VERSION \"\"\n".to_owned())].into(),
        interface: "vcan0".to_owned(),
        ..RecordingMetadata::default()
    }
}

fn record_periods(path: &Path, periods: u64) {
    let recorder = Recorder::start(path, &metadata(), RecorderOptions::default()).expect("a new file");
    let mut sender = recorder.sender();
    for sequence in 1..=periods {
        for record in period(sequence) {
            while !sender.send(record) {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }
    recorder.finish().expect("the disk works");
}

/// `Debug` shows every field; of not-a-number it hides the bits, which the tests compare beside it.
fn shown(records: &[RecordedItem]) -> Vec<String> {
    records.iter().map(|record| format!("{record:?}")).collect()
}

fn without_status(recording: &mut Recording) -> Vec<RecordedItem> {
    let records: Result<Vec<RecordedItem>, _> = recording.collect();
    records
        .expect("readable")
        .into_iter()
        .filter(|record| !matches!(record, RecordedItem::Status(_)))
        .collect()
}

#[test]
fn every_message_comes_back_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let mut frame =
        RawFrame { stamp_ns: 9, id: 0x117, flags: FrameFlags::EXTENDED, length: 4, ..RawFrame::default() };
    frame.data[..4].copy_from_slice(&[0, 0, 0xc7, 0x38]);
    let plain: Vec<RecordedItem> = vec![
        GuardEvent { sequence: 1, value: f64::NEG_INFINITY, ..GuardEvent::default() }.into(),
        Heartbeat { count: 3, process_id: 77, ..Heartbeat::default() }.into(),
        frame.into(),
        command(99).into(),
        applied(99).into(),
    ];
    let recorder = Recorder::start(&path, &metadata(), RecorderOptions::default()).expect("a new file");
    let mut sender = recorder.sender();
    for record in plain.iter().chain(&period(3)) {
        assert!(sender.send(*record));
    }
    let summary = recorder.finish().expect("the disk works");
    assert_eq!((summary.written, summary.dropped), (9, 0));

    let mut recording = Recording::open(&path).expect("a recording");
    assert_eq!(recording.metadata().bench, metadata().bench);
    assert_eq!(recording.metadata().seeds, metadata().seeds);
    assert_eq!(recording.metadata().dbc_files, metadata().dbc_files);
    let back = without_status(&mut recording);
    assert_eq!(recording.end(), Some(&End::Whole));
    let steps: Vec<&RecordedItem> = back
        .iter()
        .filter(|record| matches!(record, RecordedItem::ControlStep(_) | RecordedItem::GuardStep(_)))
        .collect();
    let expected = period(3);
    assert_eq!(format!("{:?}", steps[0]), format!("{:?}", expected[1]));
    assert_eq!(format!("{:?}", steps[1]), format!("{:?}", expected[2]));
    let RecordedItem::ControlStep(step) = steps[0] else { panic!("the first step is the controller's") };
    assert_eq!(step.sensors.body_angle.value.to_bits(), ODD_NAN);
    assert_eq!(step.command.rotor[1].to_bits(), (-0.0_f64).to_bits());
    let shown = shown(&back);
    for record in &plain {
        assert!(shown.contains(&format!("{record:?}")), "{record:?} is in the recording");
    }
    // What was published and then consumed by two steps is written once.
    assert_eq!(back.iter().filter(|record| matches!(record, RecordedItem::Sensors(_))).count(), 1);
}

#[test]
fn a_recording_that_is_there_is_never_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, "precious").expect("a file");
    let error = Recorder::start(&path, &metadata(), RecorderOptions::default()).expect_err("it exists");
    assert!(error.to_string().ends_with("run.mcap"), "{error}");
    assert_eq!(std::fs::read_to_string(&path).expect("still there"), "precious");
}

#[test]
fn cut_anywhere_it_gives_back_a_beginning_and_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let recorder =
        Recorder::start(&path, &metadata(), RecorderOptions { chunk_ms: 1, ..RecorderOptions::default() })
            .expect("a new file");
    let mut sender = recorder.sender();
    for sequence in 1..=60 {
        period(sequence).into_iter().for_each(|record| assert!(sender.send(record)));
        std::thread::sleep(Duration::from_millis(1));
    }
    recorder.finish().expect("the disk works");
    let whole = std::fs::read(&path).expect("readable");
    let all = shown(&without_status(&mut Recording::open(&path).expect("a recording")));
    let cut = folder.path().join("cut.mcap");
    let mut longest = 0;
    let mut opened = 0;
    for length in (0..whole.len()).step_by(97) {
        std::fs::write(&cut, &whole[..length]).expect("written");
        let Ok(mut recording) = Recording::open(&cut) else {
            assert!(opened == 0, "once the metadata is there, every longer beginning opens");
            continue;
        };
        opened += 1;
        let back = shown(&without_status(&mut recording));
        assert_eq!(back, all[..back.len()], "a beginning of what was recorded");
        assert!(back.len() >= longest, "a longer file holds no less");
        longest = back.len();
    }
    assert!(opened > 100 && longest > all.len() / 2, "opened {opened}, longest {longest} of {}", all.len());
}

#[test]
fn damage_is_found_and_ends_the_reading() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    record_periods(&path, 20);
    let whole = std::fs::read(&path).expect("readable");
    let all = shown(&without_status(&mut Recording::open(&path).expect("a recording")));
    let damaged = folder.path().join("damaged.mcap");
    for place in (0..whole.len()).step_by(61) {
        let mut bytes = whole.clone();
        bytes[place] ^= 0x10;
        std::fs::write(&damaged, &bytes).expect("written");
        // Whatever stands there: no panic, no endless reading, and nothing that was not recorded.
        if let Ok(recording) = Recording::open(&damaged) {
            let back: Vec<RecordedItem> = recording
                .map_while(Result::ok)
                .filter(|record| !matches!(record, RecordedItem::Status(_)))
                .collect();
            assert!(back.len() <= all.len());
            for record in shown(&back) {
                assert!(all.contains(&record), "damage at byte {place} made up {record}");
            }
        }
    }
}

/// A disk in memory that takes only so much, or takes its time.
#[derive(Clone)]
struct BadDisk {
    content: Arc<Mutex<Vec<u8>>>,
    room: Arc<Mutex<usize>>,
    pause: Duration,
}

impl BadDisk {
    fn new(room: usize, pause: Duration) -> Self {
        Self { content: Arc::default(), room: Arc::new(Mutex::new(room)), pause }
    }
}

impl Write for BadDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        std::thread::sleep(self.pause);
        let mut content = self.content.lock().expect("not poisoned");
        let count = bytes.len().min(self.room.lock().expect("not poisoned").saturating_sub(content.len()));
        if count == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        content.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Disk for BadDisk {
    fn truncate(&mut self, length: u64) -> io::Result<()> {
        self.content.lock().expect("not poisoned").truncate(length as usize);
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn saved(disk: &BadDisk) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("saved.mcap");
    std::fs::write(&path, &*disk.content.lock().expect("not poisoned")).expect("written");
    (folder, path)
}

#[test]
fn a_full_disk_leaves_a_readable_file_and_counts_what_is_lost() {
    let disk = BadDisk::new(300_000, Duration::ZERO);
    let options = RecorderOptions { queue_records: 256, chunk_ms: 1 };
    let recorder =
        Recorder::start_on(Box::new(disk.clone()), &metadata(), options).expect("room for the start");
    let mut sender = recorder.sender();
    let mut sent = 0;
    for sequence in 1..=4000 {
        for record in period(sequence) {
            sender.send(record);
            sent += 1;
        }
        if sequence % 16 == 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    assert!(recorder.summary().dropped > 0, "back-pressure is counted while the disk is full");
    let error = recorder.finish().expect_err("the disk stays full");
    assert!(error.to_string().contains("cannot be written"), "{error}");
    assert_eq!(sent, 16_000);
    let (_folder, path) = saved(&disk);
    let mut recording = Recording::open(&path).expect("the beginning is readable");
    let back = without_status(&mut recording);
    assert!(back.len() > 200, "{} records before the disk was full", back.len());
    assert!(matches!(recording.end(), Some(End::CutOff { .. })));
}

/// A defect of what writes is as a disk that fails: the recording ends, and neither the process nor a sender that waits for room.
#[test]
fn a_recorder_that_panics_ends_its_recording_and_nothing_else() {
    struct Defect(u32);
    impl Write for Defect {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0 += 1;
            assert!(self.0 < 20, "a defect, for this test");
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    impl Disk for Defect {
        fn truncate(&mut self, _length: u64) -> io::Result<()> {
            Ok(())
        }

        fn sync(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let shutdown = Shutdown::listen().expect("signals");
    let options = RecorderOptions { queue_records: 64, chunk_ms: 1 };
    let recorder = Recorder::start_on(Box::new(Defect(0)), &metadata(), options).expect("room for the start");
    let mut sender = recorder.sender();
    for sequence in 1..=2000 {
        period(sequence).into_iter().for_each(|record| sender.send_patiently(record));
        std::thread::sleep(Duration::from_micros(10));
    }
    assert!(recorder.has_failed());
    assert!(!shutdown.is_requested(), "the guard's process runs on: {}", shutdown.reason());
    let summary = recorder.summary();
    assert!(summary.dropped > 0, "what is lost is counted: {summary:?}");
    let error = recorder.finish().expect_err("it did not end well");
    assert!(format!("{error:?}").contains("the recorder panicked"), "{error:?}");
    // Any other thread's panic ends the process.
    std::thread::spawn(|| panic!("a defect, for this test")).join().expect_err("panicked");
    assert_eq!(shutdown.reason(), "a thread panicked");
}

#[test]
fn a_disk_that_gets_room_again_goes_on() {
    let disk = BadDisk::new(200_000, Duration::ZERO);
    let options = RecorderOptions { queue_records: 64, chunk_ms: 1 };
    let recorder =
        Recorder::start_on(Box::new(disk.clone()), &metadata(), options).expect("room for the start");
    let mut sender = recorder.sender();
    let mut sequence = 0;
    while sender.dropped() == 0 || recorder.summary().disk_full_ns == 0 {
        sequence += 1;
        period(sequence).into_iter().for_each(|record| {
            sender.send(record);
        });
        std::thread::sleep(Duration::from_micros(200));
    }
    *disk.room.lock().expect("not poisoned") = usize::MAX;
    let last = sensors(1_000_000);
    while !sender.send(last) {
        std::thread::sleep(Duration::from_millis(1));
    }
    let summary = recorder.finish().expect("there is room again");
    assert!(summary.dropped > 0 && summary.disk_full_ns > 0, "{summary:?}");
    let (_folder, path) = saved(&disk);
    let mut recording = Recording::open(&path).expect("a recording");
    let records: Vec<RecordedItem> = recording.by_ref().map(|record| record.expect("readable")).collect();
    assert_eq!(recording.end(), Some(&End::Whole));
    assert!(
        records.iter().any(|record| matches!(record, RecordedItem::Sensors(it) if it.sequence == 1_000_000))
    );
    let Some(RecordedItem::Status(status)) = records.last() else { panic!("the recorder has the last word") };
    assert_eq!(status.dropped, summary.dropped, "the file itself says how much is missing");
}

#[test]
fn a_slow_disk_is_never_felt_by_the_sender() {
    let disk = BadDisk::new(usize::MAX, Duration::from_millis(100));
    let options = RecorderOptions { queue_records: 128, chunk_ms: 1 };
    let recorder = Recorder::start_on(Box::new(disk), &metadata(), options).expect("slow, but there");
    let mut sender = recorder.sender();
    let mut calls = 0_u64;
    // The sender never waits for the disk: whatever the disk does, each call comes back, taken or counted.
    let taken = (1..=2000).flat_map(period).filter(|record| {
        calls += 1;
        sender.send(*record)
    });
    let taken = taken.count() as u64;
    assert_eq!(taken + sender.dropped(), calls);
    assert!(sender.dropped() > 0, "two thousand periods at once are more than the queue holds");
    let summary = recorder.finish().expect("slow, but it works");
    assert_eq!(summary.written, taken);
}
