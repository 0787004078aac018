//! The recorder's memory, in a process of its own: what other tests hold for a while is not counted.

use std::io::{self, Write};

use rotorbench::recording::{Disk, Record, Recorder, RecorderOptions, RecordingMetadata};
use rotorbench::signal::{Applied, Command, ControlStep, CycleSample, GuardStep, Sensors};

/// One period of a bench: what its threads would send.
fn period(sequence: u64) -> [Record; 4] {
    let stamp_ns = sequence * 1_000_000;
    let sensors = Sensors { sequence, stamp_ns, ..Sensors::default() };
    let command = Command { sequence, stamp_ns, rotor: [0.1, 0.2], ..Command::default() };
    let applied = Applied { sequence, stamp_ns, rotor: [0.5, 0.25], ..Applied::default() };
    [
        sensors.into(),
        ControlStep { sensors, applied, command }.into(),
        GuardStep::new(stamp_ns + 7, &sensors, Some(&command), None, &applied).into(),
        CycleSample { slot: sequence, finished_ns: stamp_ns, ..CycleSample::default() }.into(),
    ]
}

/// Memory of this process, from the kernel. [kB]
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("a line");
    line.trim().trim_end_matches(" kB").trim().parse().expect("a number")
}

/// The short version of an hour at 1 kHz: `ROTORBENCH_SOAK_PERIODS` makes it the long one (3600000).
#[test]
fn memory_stays_flat_however_long_it_records() {
    let wanted = std::env::var("ROTORBENCH_SOAK_PERIODS").ok().and_then(|text| text.parse().ok());
    let periods: u64 = wanted.unwrap_or(60_000);
    let options = RecorderOptions { queue_records: 4096, ..RecorderOptions::default() };
    let recorder =
        Recorder::start_on(Box::new(Nowhere), &RecordingMetadata::default(), options).expect("started");
    let mut sender = recorder.sender();
    let mut after_warm_up = 0;
    for sequence in 1..=periods {
        period(sequence).into_iter().for_each(|record| sender.send_patiently(record));
        if sequence == periods / 4 {
            after_warm_up = resident_kb();
        }
    }
    let grown = resident_kb().saturating_sub(after_warm_up);
    let summary = recorder.finish().expect("nowhere is never full");
    assert_eq!((summary.written, summary.dropped), (4 * periods, 0));
    writeln!(io::stderr(), "    {periods} periods: {grown} kB more after three quarters of them")
        .expect("written");
    // Seen: 16 to 120 kB, pages the allocator had not touched before. A record of 100 bytes kept each period would be
    // 4.5 MB and more.
    assert!(grown < 2_000, "{grown} kB more after three quarters of {periods} periods");
}

/// Takes everything and keeps nothing.
struct Nowhere;

impl Write for Nowhere {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Disk for Nowhere {
    fn truncate(&mut self, _: u64) -> io::Result<()> {
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}
