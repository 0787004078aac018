//! Logs of other programs, beside what the reference reader of their format says of them, and damaged.
//!
//! The files lie in `tests/formats/golden`, and where `ROTORBENCH_FORMATS` names a folder (`tools/formats` does), there.

mod damaged;
mod golden;
mod mappings;
mod reference;

use std::fs;
use std::path::PathBuf;

use rotorbench::log::candump::CandumpFrame;
use rotorbench::log::format::{FormatError, LogFormat, ReadRequest, Start};
use rotorbench::log::formats::FORMATS;
use rotorbench::log::tables::Tables;
use rotorbench::log::{asc, blf};

/// The logs, each beside the file with its reference.
fn logs() -> Vec<(PathBuf, PathBuf)> {
    let golden = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/formats/golden"));
    let folders = [golden].into_iter().chain(std::env::var_os("ROTORBENCH_FORMATS").map(PathBuf::from));
    let mut found = Vec::new();
    for folder in folders {
        for entry in fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let reference = entry.expect("an entry").path();
            if reference.extension().is_some_and(|extension| extension == "json") {
                found.push((reference.with_extension(""), reference));
            }
        }
    }
    found.sort();
    found
}

/// The format of a file, by its first bytes.
fn format_of(path: &std::path::Path, bytes: &[u8]) -> Option<&'static dyn LogFormat> {
    let start = Start { bytes: &bytes[..bytes.len().min(4096)], path };
    FORMATS.iter().copied().find(|format| format.recognises(&start))
}

/// The frames of a capture of a bus, where it is one.
fn capture(path: &std::path::Path, bytes: &[u8]) -> Option<Result<Vec<CandumpFrame>, FormatError>> {
    let start = Start { bytes: &bytes[..bytes.len().min(4096)], path };
    let read = if blf::recognises(&start) {
        blf::read(path, bytes)
    } else {
        asc::recognises(&start).then(|| asc::read(path, bytes))?
    };
    Some(read.map(|(frames, _)| frames))
}

fn read(
    format: &dyn LogFormat,
    path: &std::path::Path,
    bytes: &[u8],
    part: Option<usize>,
) -> Result<Tables, FormatError> {
    format.read(&ReadRequest { path, bytes, part, wants: &|_, _| true })
}
