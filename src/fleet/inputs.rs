//! What the answer of a bench depends on, as one hash: the same inputs have the same answer, and it is not made again.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use sha2::{Digest, Sha256};

use super::{FleetBench, FleetError};
use crate::session::addressed;

/// Version of what an answer holds: an older one is made anew.
const FORM: &str = "1";

/// SHA-256 of everything that the answer of `bench` depends on: program, settings, and the bytes of model, mapping and logs.
///
/// # Errors
/// [`FleetError::File`] of a file that cannot be read.
pub(super) fn hash(bench: &FleetBench) -> Result<String, FleetError> {
    let mut all = Sha256::new();
    let mut add = |name: &str, value: &str| {
        // The length parts one field from the next, whatever is in them.
        all.update(format!("{name} {} {value}\n", value.len()));
    };
    add("form", FORM);
    add("program", env!("CARGO_PKG_VERSION"));
    add("name", &bench.name);
    add("rotors", &format!("{:?}", bench.rotors));
    add("horizon_s", &format!("{:?}", bench.horizon_s));
    let named = |path: &Path| if path == Path::new("paper") { Ok("paper".to_owned()) } else { of_file(path) };
    add("model", &named(&bench.model)?);
    if let Some(mapping) = &bench.mapping {
        let path = Path::new(mapping);
        add("mapping", &if path.is_file() { of_file(path)? } else { mapping.clone() });
    }
    for (kind, logs) in [("log", &bench.log), ("validate", &bench.validate)] {
        for log in logs {
            let (file, part) = addressed(log);
            let part = part.map_or(String::new(), |part| part.to_string());
            add(kind, &format!("{part} {}", of_file(&file)?));
        }
    }
    Ok(hex(&all.finalize()))
}

fn of_file(path: &Path) -> Result<String, FleetError> {
    let regular = std::fs::metadata(path).map_err(FleetError::file(path))?.is_file();
    if !regular {
        let reason = io::Error::new(io::ErrorKind::InvalidInput, "no regular file");
        return Err(FleetError::file(path)(reason));
    }
    let mut hash = Sha256::new();
    let mut file = File::open(path).map_err(FleetError::file(path))?;
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block).map_err(FleetError::file(path))? {
            0 => break,
            read => hash.update(&block[..read]),
        }
    }
    Ok(hex(&hash.finalize()))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
