//! Files that appear complete or not at all.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

/// Writes `bytes` beside `path` and renames: what was there stays until the new file is complete.
///
/// # Errors
/// What the system says.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?.to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = fs::File::create(&part).and_then(|mut file| file.write_all(bytes).and(file.sync_all()));
    written.and_then(|()| fs::rename(&part, path)).inspect_err(|_| {
        // The first error is the one to tell; a leftover part file is harmless.
        let _ = fs::remove_file(&part);
    })
}
