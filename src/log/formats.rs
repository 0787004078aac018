//! The formats that logs of other programs come in.

use super::betaflight::Betaflight;
use super::dataflash::DataFlash;
use super::format::LogFormat;
use super::parquet::Parquet;
use super::ulog::Ulog;

/// The formats, in the order in which they are asked.
pub const FORMATS: &[&dyn LogFormat] = &[&Betaflight, &DataFlash, &Parquet, &Ulog];

/// Endings of the names of logs that a folder is searched for.
pub const ENDINGS: [&str; 13] =
    ["csv", "mcap", "log", "bbl", "bfl", "txt", "bin", "ulg", "parquet", "blf", "asc", "candump", "tsv"];

/// Names of everything that is read.
#[must_use]
pub fn readable() -> String {
    let own = ["CSV", "recordings of ours (MCAP)", "candump", "Vector BLF", "Vector ASC"].into_iter();
    own.chain(FORMATS.iter().map(|format| format.name())).collect::<Vec<_>>().join(", ")
}
