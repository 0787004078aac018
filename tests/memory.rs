//! Memory of the recorder and of long logs, in a process of its own: what other tests hold for a while is not counted.

use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};

use rotorbench::identify::{self, IdentifySettings};
use rotorbench::log::Dataset;
use rotorbench::recording::{Disk, RecordedItem, Recorder, RecorderOptions, RecordingMetadata};
use rotorbench::screening::ScreenedLog;
use rotorbench::signal::{Applied, Command, ControlStep, CycleSample, GuardStep, Sensors};

/// As the program has it.
#[global_allocator]
static MEMORY: rotorbench::memory::LongBlocks = rotorbench::memory::LongBlocks;

/// One period of a bench: what its threads would send.
fn period(sequence: u64) -> [RecordedItem; 4] {
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

/// Each test measures the memory of the whole process.
static ALONE: Mutex<()> = Mutex::new(());

/// Memory of this process, from the kernel. [kB]
fn resident_kb() -> u64 {
    of_status("VmRSS:")
}

fn of_status(name: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find_map(|line| line.strip_prefix(name)).expect("a line");
    line.trim().trim_end_matches(" kB").trim().parse().expect("a number")
}

/// How much more memory the work takes at its height than was taken before. [kB]
fn height_kb(work: impl FnOnce()) -> u64 {
    // Forgets the height so far.
    std::fs::write("/proc/self/clear_refs", "5").expect("Linux");
    let before = resident_kb();
    work();
    of_status("VmHWM:").saturating_sub(before)
}

/// The short version of an hour at 1 kHz: `ROTORBENCH_SOAK_PERIODS` makes it the long one (3600000).
#[test]
fn memory_stays_flat_however_long_it_records() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
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

/// Rows of the log at 1 kHz, and its columns, time among them.
const ROWS: usize = 300_000;
const COLUMNS: u64 = 8;

/// Two rotors that follow pseudo-random levels on a battery that gives way, and the body that they turn; rates in every fifth row.
fn long_log() -> Dataset {
    let time: Vec<f64> = (0..ROWS).map(|row| 0.001 * row as f64).collect();
    let level = |row: usize, rotor: usize| {
        let slot = (row / 40 + 7_919 * rotor) as u32;
        0.42 + 0.02 * f64::from((slot.wrapping_mul(2_654_435_761) >> 16) % 8)
    };
    let noise = |row: usize| f64::from((row as u32).wrapping_mul(2_246_822_519) >> 8) / 8_388_608.0 - 1.0;
    let volts: Vec<f64> = time.iter().map(|time| 12.5 - 0.002 * time).collect();
    let mut log = Dataset::new("long", "", time).expect("time rises");
    let mut rates = Vec::new();
    for rotor in 0..2 {
        let command: Vec<f64> = (0..ROWS).map(|row| level(row, rotor)).collect();
        let mut rate = 1_300.0 * command[0];
        let follows = command.iter().zip(&volts).map(|(command, volts)| {
            rate += 0.016 * (1_300.0 * command - 20.0 * (12.6 - volts) - rate);
            rate
        });
        let rate: Vec<f64> = follows.collect();
        let read = |(row, rate): (usize, &f64)| if row % 5 == 0 { rate + noise(row) } else { f64::NAN };
        log.insert(
            format!("propeller_rate_{}_rad_s", rotor + 1),
            rate.iter().enumerate().map(read).collect(),
        )
        .expect("fits");
        log.insert(format!("command_{}", rotor + 1), command).expect("fits");
        rates.push(rate);
    }
    let mut turning = 0.0;
    let turns = rates[0].iter().zip(&rates[1]).enumerate().map(|(row, (first, second))| {
        turning += 1e-7 * (first * first - second * second);
        turning + 0.004 * noise(row)
    });
    log.insert("body_rate_rad_s", turns.collect()).expect("fits");
    let swings = (0..ROWS).map(|row| 0.3 * (0.002 * row as f64).sin()).collect();
    log.insert("body_angle_rad", swings).expect("fits");
    log.insert("battery_voltage_v", volts).expect("fits");
    log
}

/// A fit lays few columns out beside those of the log.
#[test]
fn a_fit_to_a_long_log_takes_a_few_times_its_columns() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let columns_kb = COLUMNS * ROWS as u64 * 8 / 1_000;
    let log = ScreenedLog::from(long_log());
    let settings = IdentifySettings::default();
    let fits = height_kb(|| {
        identify::identify(std::slice::from_ref(&log), &[], &settings).expect("rotors are excited");
    });
    let of_columns = fits as f64 / columns_kb as f64;
    writeln!(io::stderr(), "    {of_columns:.2} times the columns").expect("written");
    // Twelve times, where each fit had rows of its own.
    assert!(of_columns < 6.0, "{fits} kB beside columns of {columns_kb} kB");
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
