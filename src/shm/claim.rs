//! Who publishes a topic: one process at a time, and which of its incarnations.
//!
//! iceoryx2 0.10 cannot give the blackboard of a killed writer to its successor while a reader still holds it.
//! So each incarnation of a publisher makes its own blackboard, and a small file says which one is current. The file is
//! locked by its publisher, which the kernel undoes however the process ends; a second publisher is refused.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

use super::place::BenchPlace;
use super::{ProcessRole, ShmError};
use crate::clock;

/// What a claim says: which role publishes, in which process, and the name of this incarnation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Claimant {
    pub role: String,
    pub process_id: u32,
    pub incarnation: String,
}

/// The right to publish a topic, for as long as it is held.
#[derive(Debug)]
pub(super) struct Claim {
    file: File,
    path: PathBuf,
    claimant: Claimant,
}

pub(super) fn claims_directory(place: &BenchPlace) -> PathBuf {
    place.directory().join("claims")
}

/// Whether somebody publishes something there, or whether that cannot be found out.
pub(super) fn any_is_held(place: &BenchPlace) -> bool {
    let Ok(claims) = std::fs::read_dir(claims_directory(place)) else { return true };
    claims.flatten().any(|claim| is_held(claim.path()))
}

/// Whether a process holds the claim of this file, or whether that cannot be found out. Where there is no file, nobody does.
pub(super) fn is_held(path: PathBuf) -> bool {
    match OpenOptions::new().read(true).write(true).custom_flags(libc::O_NOFOLLOW).open(path) {
        Ok(file) => file.try_lock().is_err(),
        Err(error) => error.kind() != std::io::ErrorKind::NotFound,
    }
}

impl Claim {
    /// Claims `topic`; nobody knows of it before [`Claim::announce`].
    pub fn take(place: &BenchPlace, topic: &str, role: ProcessRole) -> Result<Self, ShmError> {
        let path = claims_directory(place).join(topic);
        let at = |error| ShmError::Place { path: path.clone(), error };
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(place.file_mode())
            .custom_flags(libc::O_NOFOLLOW)
            .open(&path)
            .map_err(at)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let holder = read(place, topic);
                return Err(ShmError::Claimed {
                    bench: place.bench().to_owned(),
                    topic: topic.to_owned(),
                    role: holder.as_ref().map_or_else(|| "another process".to_owned(), |it| it.role.clone()),
                    process_id: holder.map_or(0, |it| it.process_id),
                });
            }
            Err(TryLockError::Error(error)) => return Err(at(error)),
        }
        let process_id = std::process::id();
        let incarnation = format!("{:x}-{process_id}", clock::monotonic_ns());
        let claimant = Claimant { role: role.name().to_owned(), process_id, incarnation };
        Ok(Self { file, path, claimant })
    }

    /// Name of this incarnation.
    pub fn incarnation(&self) -> &str {
        &self.claimant.incarnation
    }

    /// Tells everybody which incarnation is current. One write: a reader sees all of it or nothing.
    pub fn announce(&mut self) -> Result<(), ShmError> {
        let Claimant { role, process_id, incarnation } = &self.claimant;
        let line = format!("{role} {process_id} {incarnation}\n");
        self.write(line.as_bytes())
    }

    fn write(&mut self, content: &[u8]) -> Result<(), ShmError> {
        let mut store = || {
            self.file.set_len(0)?;
            self.file.seek(SeekFrom::Start(0))?;
            self.file.write_all(content)
        };
        store().map_err(|error| ShmError::Place { path: self.path.clone(), error })
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Best effort: a claim that still names a incarnation that ended leads readers to nothing new.
        let _ = self.write(b"");
    }
}

/// The current claimant of `topic`, if there is one to be read.
pub(super) fn read(place: &BenchPlace, topic: &str) -> Option<Claimant> {
    let mut text = String::new();
    File::open(claims_directory(place).join(topic)).ok()?.read_to_string(&mut text).ok()?;
    let (line, _) = text.split_once('\n')?;
    let mut words = line.split(' ');
    let role = words.next()?.to_owned();
    let process_id = words.next()?.parse().ok()?;
    Some(Claimant { role, process_id, incarnation: words.next()?.to_owned() })
}
