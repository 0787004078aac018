//! Reads a log of any format and says which of its readings are measurements.
//!
//!     cargo run --example read_log -- LOG

use std::error::Error;
use std::path::{Path, PathBuf};

use rotorbench::cancel::Cancel;
use rotorbench::report::findings::sentence;
use rotorbench::session::{self, Job, OpenConfig};

/// Prints the result.
pub fn main() -> Result<(), Box<dyn Error>> {
    // The log named on the command line; without one, a log of an attitude bench that lies beside the tests.
    let kept = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/record/kept/attitude.csv");
    let named = std::env::args_os().skip(1).map(PathBuf::from).find(|path| path.is_file());
    print!("{}", summary(&named.unwrap_or_else(|| kept.into()))?);
    Ok(())
}

/// The channels of a log, with their number of measurements, and what its screening found.
pub fn summary(path: &Path) -> Result<String, Box<dyn Error>> {
    let cancel = Cancel::default();
    // A recording, a candump log and a CSV in our format say what they are; a foreign CSV needs a mapping.
    let screened = session::open(path, &OpenConfig::default(), &Job::unwatched(&cancel))?.log;
    let log = screened.raw();
    let span = log.time().last().zip(log.time().first()).map_or(0.0, |(last, first)| last - first);
    let mut text = format!("{}: {} rows in {span:.2} s\n", log.source_name(), log.len());

    for name in log.names() {
        let readings = log.column(name).unwrap_or_default();
        let there = readings.iter().filter(|value| value.is_finite()).count();
        let left_out = screened.channel(name).map_or(0, |channel| channel.left_out().count());
        text += &format!("  {name}: {there} readings, {left_out} left out\n");
    }
    for finding in screened.findings() {
        text += &format!("  {}: {}\n", finding.code, sentence(finding));
    }
    Ok(text)
}
