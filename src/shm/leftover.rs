//! What benches that nobody is on any more left in shared memory.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

use super::claim;
use super::place::{BenchPlace, SHARED_MEMORY, STEM, SharedMemoryConfig};
use super::thresholds::THRESHOLDS;
use super::{APPLIED, ShmError};

/// A bench of this user, or of a group this user is in, without a process on it.
#[derive(Debug, Clone)]
pub struct Leftover {
    /// Name of the bench.
    pub bench: String,
    place: BenchPlace,
    /// Its files in `/dev/shm`, its directory among them.
    pub files: usize,
    /// [byte] they occupy.
    pub bytes: u64,
}

impl Leftover {
    /// Removes it.
    ///
    /// # Errors
    /// The operating system's, with the path.
    pub fn remove(&self) -> Result<usize, ShmError> {
        self.place.remove()
    }
}

/// A bench that is there for one command only: what it and its processes leave in shared memory goes with this.
#[derive(Debug)]
pub struct PassingBench(BenchPlace);

impl PassingBench {
    /// Makes the place of the bench called `bench`.
    ///
    /// # Errors
    /// As [`BenchPlace::open`].
    pub fn open(bench: &str, config: &SharedMemoryConfig) -> Result<Self, ShmError> {
        BenchPlace::open(bench, config).map(Self)
    }
}

impl Drop for PassingBench {
    fn drop(&mut self) {
        // What stays is in memory only, and `doctor --fix` finds it.
        let _ = self.0.remove();
    }
}

/// Benches of this user, and of groups this user is in, that no process has open. A stopped process still has its bench
/// open. Processes of other users cannot be looked into: of a group's bench those count that publish something.
#[must_use]
pub fn leftovers() -> Vec<Leftover> {
    let open = mapped();
    let youngest = Duration::from_secs(THRESHOLDS.youngest_leftover_s);
    let mut found = Vec::new();
    for entry in fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let Some(place) = BenchPlace::found(&name) else { continue };
        let Ok(metadata) = entry.metadata() else { continue };
        let age = metadata.modified().ok().and_then(|time| time.elapsed().ok()).unwrap_or_default();
        let is_left =
            metadata.is_dir() && place.is_ours(&metadata) && age >= youngest && !open.contains(&name);
        if !is_left || claim::any_is_held(&place) {
            continue;
        }
        let sizes = segments(place.prefix());
        let (files, bytes) = (sizes.len() + 1, sizes.iter().sum());
        found.push(Leftover { bench: place.bench().to_owned(), place, files, bytes });
    }
    found.sort_by(|a, b| a.bench.cmp(&b.bench));
    found
}

/// Names of the benches of this user, and of groups this user is in, on which somebody publishes something.
#[must_use]
pub fn running() -> Vec<String> {
    running_places().iter().map(|place| place.bench().to_owned()).collect()
}

/// Where these benches are, by their names.
#[must_use]
pub fn running_places() -> Vec<BenchPlace> {
    let mut found = Vec::new();
    for entry in fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten() {
        let place = BenchPlace::found(&entry.file_name().to_string_lossy());
        let Some((place, metadata)) = place.zip(entry.metadata().ok()) else { continue };
        if metadata.is_dir() && place.is_ours(&metadata) && claim::any_is_held(&place) {
            found.push(place);
        }
    }
    found.sort_by(|a, b| a.bench().cmp(b.bench()));
    found
}

/// Whether a process has the guard of the bench at `place`.
#[must_use]
pub fn is_guarded(place: &BenchPlace) -> bool {
    claim::is_held(claim::claims_directory(place).join(APPLIED.name()))
}

/// The process that guards the bench of `place` though its directory was removed: it hears what is asked of it, and its answers
/// lead nowhere. Processes of other users cannot be looked into.
#[must_use]
pub fn guard_without_place(place: &BenchPlace) -> Option<u32> {
    // What the kernel says of an open file that was removed.
    let claim = claim::claims_directory(place).join(APPLIED.name());
    let removed = format!("{} (deleted)", claim.display());
    let has_open = |process: &fs::DirEntry| {
        let mut files = fs::read_dir(process.path().join("fd")).into_iter().flatten().flatten();
        files.any(|file| fs::read_link(file.path()).is_ok_and(|open| open == Path::new(&removed)))
    };
    let mut processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    processes.find(has_open).and_then(|process| process.file_name().to_str()?.parse().ok())
}

/// [byte] occupied by each segment of a bench.
fn segments(prefix: &str) -> Vec<u64> {
    let entries = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let ours = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix));
    // A block is 512 bytes: what is occupied, not what is reserved.
    ours.filter_map(|entry| entry.metadata().ok()).map(|metadata| metadata.blocks() * 512).collect()
}

/// Names in `/dev/shm` of the benches that some process has mapped into its memory.
fn mapped() -> BTreeSet<String> {
    let start = Path::new(SHARED_MEMORY).join(STEM).to_string_lossy().into_owned();
    let mut benches = BTreeSet::new();
    for process in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Ok(maps) = fs::read_to_string(process.path().join("maps")) else { continue };
        for (at, _) in maps.match_indices(&start) {
            let rest = maps.get(at + start.len()..).unwrap_or("");
            let name: String = rest.chars().take_while(|letter| *letter != '.' && *letter != '\n').collect();
            benches.insert(format!("{STEM}{name}"));
        }
    }
    benches
}
