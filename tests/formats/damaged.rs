//! Logs that break off or have flipped bits: an error or a shorter log, never a panic.

use std::fs;
use std::path::Path;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::reference::Reference;
use super::{capture, format_of, logs, read};
use rotorbench::log::format::FormatError;
use rotorbench::log::tables::Table;

/// Bytes between two places at which a log is cut off.
const CUT_EVERY: usize = 997;

/// Damaged copies of each log.
const COPIES: u64 = 1000;

/// Rows or frames that are read of a log; none where it is recognised no more.
fn rows(path: &Path, bytes: &[u8], part: Option<usize>) -> Result<usize, FormatError> {
    match (format_of(path, bytes), capture(path, bytes)) {
        (Some(format), _) => {
            let tables = read(format, path, bytes, part)?.tables;
            // A table has no time where its format does not say which column that is.
            let rows = |table: &Table| table.columns.first().map_or(0, |column| column.values.len());
            for table in &tables {
                assert!(table.time.len() == rows(table) || table.time.is_empty());
                assert!(table.columns.iter().all(|column| column.values.len() == rows(table)));
            }
            Ok(tables.iter().map(rows).sum())
        }
        (None, Some(frames)) => Ok(frames?.len()),
        (None, None) => Ok(0),
    }
}

#[test]
fn no_damage_ends_in_a_panic() {
    for (path, reference) in logs() {
        let part = Reference::load(&reference).part();
        let bytes = fs::read(&path).expect("a log");
        let whole = rows(&path, &bytes, part).expect("a good log");
        assert!(whole > 0, "{}", path.display());
        for end in (0..bytes.len()).step_by(CUT_EVERY) {
            if let Ok(shorter) = rows(&path, &bytes[..end], part) {
                assert!(shorter <= whole, "{}, cut at {end}", path.display());
            }
        }
        for seed in 0..COPIES {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..8) {
                let place = rng.random_range(0..damaged.len());
                damaged[place] ^= 1 << rng.random_range(0..8);
            }
            // What comes out is an error that names the file, or a log.
            if let Err(error) = rows(&path, &damaged, part) {
                assert!(error.to_string().contains(&path.display().to_string()), "{error}");
            }
        }
    }
}
