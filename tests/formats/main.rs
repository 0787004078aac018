//! Logs of other programs, beside what the reference reader of their format says of them, and damaged.
//!
//! The files lie in `tests/formats/golden`, and where `ROTORBENCH_FORMATS` names a folder (`tools/formats` does), there.

mod damaged;
mod golden;
mod mappings;
mod reference;

use std::fs;
use std::path::PathBuf;

use rotorbench::log::format::{FORMATS, FormatError, LogFormat, Request, Start};
use rotorbench::log::tables::Tables;

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

fn read(
    format: &dyn LogFormat,
    path: &std::path::Path,
    bytes: &[u8],
    part: Option<usize>,
) -> Result<Tables, FormatError> {
    format.read(&Request { path, bytes, part, wants: &|_, _| true })
}
