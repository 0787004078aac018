//! Any bytes as a log of another program, in the format that they look like: a table whose columns are as long as its time, or an
//! error that names the file.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use rotorbench::log::format::{ReadRequest, Start};
use rotorbench::log::formats::FORMATS;
use rotorbench::log::{asc, blf};

/// Bytes by which a format is recognised.
const START: usize = 4096;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("fuzzed.log");
    let start = Start { bytes: &bytes[..bytes.len().min(START)], path };
    if blf::recognises(&start) {
        let _ = blf::read(path, bytes);
    } else if asc::recognises(&start) {
        let _ = asc::read(path, bytes);
    }
    let Some(format) = FORMATS.iter().find(|format| format.recognises(&start)) else { return };
    match format.read(&ReadRequest { path, bytes, part: None, wants: &|_, _| true }) {
        Ok(read) => {
            for table in &read.tables {
                let rows = table.columns.first().map_or(0, |column| column.values.len());
                assert!(table.time.len() == rows || table.time.is_empty());
                assert!(table.columns.iter().all(|column| column.values.len() == rows));
            }
        }
        Err(error) => assert!(error.to_string().contains("fuzzed.log"), "{error}"),
    }
});
