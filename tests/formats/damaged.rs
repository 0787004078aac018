//! Logs that break off or have flipped bits: an error or a shorter log, never a panic.

use std::fs;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::reference::Reference;
use super::{format_of, logs, read};

/// Bytes between two places at which a log is cut off.
const CUT_EVERY: usize = 997;

/// Damaged copies of each log.
const COPIES: u64 = 1000;

#[test]
fn no_damage_ends_in_a_panic() {
    for (path, reference) in logs() {
        let part = Reference::load(&reference).part();
        let bytes = fs::read(&path).expect("a log");
        let Some(format) = format_of(&path, &bytes) else { continue };
        let whole = read(format, &path, &bytes, part).expect("a good log");
        let rows = |tables: &rotorbench::log::tables::Tables| {
            tables.tables.iter().map(|table| table.time.len()).sum::<usize>()
        };
        for end in (0..bytes.len()).step_by(CUT_EVERY) {
            if let Ok(shorter) = read(format, &path, &bytes[..end], part) {
                assert!(rows(&shorter) <= rows(&whole), "{}, cut at {end}", path.display());
            }
        }
        for seed in 0..COPIES {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..8) {
                let place = rng.random_range(0..damaged.len());
                damaged[place] ^= 1 << rng.random_range(0..8);
            }
            // What comes out is an error that says so, or a log; that none of it panics is the test.
            if let Err(error) = read(format, &path, &damaged, part) {
                assert!(error.to_string().contains(&path.display().to_string()), "{error}");
            }
        }
    }
}
