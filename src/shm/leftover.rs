//! What benches that nobody is on any more left in shared memory.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

use super::ShmError;
use super::place::{Place, SHARED_MEMORY, SharedMemoryConfig, effective_user};

/// A bench touched less long ago may be one that is just starting.
const SETTLED: Duration = Duration::from_secs(2);

/// A bench of this user without a process on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leftover {
    /// Name of the bench.
    pub bench: String,
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
        Place::open(&self.bench, &SharedMemoryConfig::default())?.remove()
    }
}

/// Benches of this user that no process has open. A stopped process still has its bench open.
#[must_use]
pub fn leftovers() -> Vec<Leftover> {
    let stem = format!("rotorbench-{}-", effective_user());
    let open = mapped(&stem);
    let mut found = Vec::new();
    for entry in fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let Some(bench) = name.strip_prefix(&stem) else { continue };
        let Ok(metadata) = entry.metadata() else { continue };
        let age = metadata.modified().ok().and_then(|time| time.elapsed().ok()).unwrap_or_default();
        if !metadata.is_dir() || metadata.uid() != effective_user() || age < SETTLED || open.contains(bench) {
            continue;
        }
        let sizes = segments(&format!("{name}."));
        found.push(Leftover { bench: bench.to_owned(), files: sizes.len() + 1, bytes: sizes.iter().sum() });
    }
    found.sort_by(|a, b| a.bench.cmp(&b.bench));
    found
}

/// [byte] occupied by each segment of a bench.
fn segments(prefix: &str) -> Vec<u64> {
    let entries = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
    let ours = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix));
    // A block is 512 bytes: what is occupied, not what is reserved.
    ours.filter_map(|entry| entry.metadata().ok()).map(|metadata| metadata.blocks() * 512).collect()
}

/// Names of the benches that some process has mapped into its memory.
fn mapped(stem: &str) -> BTreeSet<String> {
    let start = Path::new(SHARED_MEMORY).join(stem).to_string_lossy().into_owned();
    let mut benches = BTreeSet::new();
    for process in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Ok(maps) = fs::read_to_string(process.path().join("maps")) else { continue };
        for (at, _) in maps.match_indices(&start) {
            let rest = maps.get(at + start.len()..).unwrap_or("");
            let bench: String = rest.chars().take_while(|letter| *letter != '.' && *letter != '\n').collect();
            benches.insert(bench);
        }
    }
    benches
}
