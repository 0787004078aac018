//! Writing with patience: a full disk is a very slow disk, not the end of the recording.

use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::thresholds::THRESHOLDS;

/// How long to wait before asking a full disk again.
const RETRY: Duration = Duration::from_millis(50);

/// Where a recording goes: a file, or in a test something worse.
pub trait Disk: Write + Send {
    /// Cuts the file to `length` bytes.
    ///
    /// # Errors
    /// The operating system's.
    fn truncate(&mut self, length: u64) -> io::Result<()>;

    /// Waits until the content is on the medium.
    ///
    /// # Errors
    /// The operating system's.
    fn sync(&mut self) -> io::Result<()>;
}

impl Disk for File {
    fn truncate(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.sync_all()
    }
}

/// What the recorder's thread and its owner share.
#[derive(Debug, Default)]
pub(crate) struct WriteProgress {
    /// Set when the recording is to end.
    pub(crate) closing: AtomicBool,
    /// [ns] time in which the disk was full.
    pub(crate) disk_full_ns: AtomicU64,
    /// Records written.
    pub(crate) written: AtomicU64,
    /// Bytes that make whole chunks: what is kept when the rest cannot be written.
    pub(crate) whole_bytes: AtomicU64,
    /// The disk failed for good; nothing more is written.
    pub(crate) failed: AtomicBool,
}

/// A disk that is asked again while it is full, until the recording is being closed.
pub(crate) struct PatientDisk {
    disk: Box<dyn Disk>,
    progress: Arc<WriteProgress>,
    position: u64,
    given_up: bool,
}

impl PatientDisk {
    pub(crate) fn new(disk: Box<dyn Disk>, progress: Arc<WriteProgress>) -> Self {
        Self { disk, progress, position: 0, given_up: false }
    }

    /// All bytes so far make whole chunks.
    pub(crate) fn mark_whole(&mut self) {
        self.progress.whole_bytes.store(self.position, Ordering::Relaxed);
    }

    pub(crate) fn sync(&mut self) -> io::Result<()> {
        self.disk.sync()
    }

    /// Cuts off the half-written chunk, so that the file can be read, and refuses all further writes.
    fn give_up(&mut self, error: io::Error) -> io::Error {
        self.given_up = true;
        self.progress.failed.store(true, Ordering::Relaxed);
        if let Err(truncation) = self.disk.truncate(self.progress.whole_bytes.load(Ordering::Relaxed)) {
            tracing::debug!("the half-written chunk stays at the end of the recording: {truncation}");
        }
        error
    }
}

fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)
}

impl Write for PatientDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.given_up {
            return Err(io::Error::other("the recording was given up"));
        }
        let mut full_since = None;
        let mut closing_since = None;
        loop {
            let error = match self.disk.write(bytes) {
                Ok(count) => {
                    if let Some(since) = full_since {
                        tracing::warn!("the disk takes data again after {:.1} s", elapsed_s(since));
                    }
                    self.position += count as u64;
                    return Ok(count);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => error,
            };
            let closing = self.progress.closing.load(Ordering::Relaxed);
            let patience_ends =
                closing && elapsed_s(*closing_since.get_or_insert_with(Instant::now)) >= THRESHOLDS.closing_s;
            if !is_full(&error) || patience_ends {
                return Err(self.give_up(error));
            }
            if full_since.is_none() {
                full_since = Some(Instant::now());
                tracing::warn!(
                    "{error}: the recording waits for space; what the queue cannot hold is counted"
                );
            }
            std::thread::sleep(RETRY);
            self.progress.disk_full_ns.fetch_add(RETRY.as_nanos() as u64, Ordering::Relaxed);
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.disk.flush()
    }
}

fn elapsed_s(since: Instant) -> f64 {
    since.elapsed().as_secs_f64()
}
