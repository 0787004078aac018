//! The recorder's own thread: takes records from the queues and has them written, a chunk at least once a second, so that
//! `kill -9` costs at most the last second.

use std::fs::OpenOptions;
use std::io;
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::clock::monotonic_ns;
use crate::rt;

use super::RecordError;
use super::messages::RecorderStatus;
use super::metadata::RecordingMetadata;
use super::patient_disk::{Disk, PatientDisk, WriteProgress};
use super::sender::{Lane, RecordSender, RecordedItem};
use super::sink::Sink;

/// How often the queues are looked into. Polling costs the sending threads nothing; waking us would.
const POLL: Duration = Duration::from_millis(5);

/// Settings of a recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecorderOptions {
    /// Records each sending thread may be ahead of the disk; some 600 bytes each.
    pub queue_records: usize,
    /// [ms] longest time between a record and its way to the kernel.
    pub chunk_ms: u64,
}

impl Default for RecorderOptions {
    /// Four seconds of a 1 kHz bench with eight records a period; a chunk each half second, so that with the
    /// writing itself a killed recorder has lost less than one.
    fn default() -> Self {
        Self { queue_records: 32_768, chunk_ms: 500 }
    }
}

/// What a recording amounted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RecorderSummary {
    /// Records written.
    pub written: u64,
    /// Records refused because the queue was full, or lost because the disk failed.
    pub dropped: u64,
    /// [ns] time in which the disk was full.
    pub disk_full_ns: u64,
}

type Lanes = Arc<Mutex<Vec<Arc<Lane>>>>;

/// A recording in progress.
#[derive(Debug)]
pub struct Recorder {
    lanes: Lanes,
    progress: Arc<WriteProgress>,
    options: RecorderOptions,
    thread: Option<JoinHandle<Result<(), RecordError>>>,
}

impl Recorder {
    /// Starts recording into a new file. Call it before the process becomes real-time: the recorder's thread
    /// inherits priority and affinity, and takes off only the priority.
    ///
    /// # Errors
    /// [`RecordError::Create`] when `path` exists already or cannot be written.
    pub fn start(
        path: &Path,
        metadata: &RecordingMetadata,
        options: RecorderOptions,
    ) -> Result<Self, RecordError> {
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(path)
            .map_err(|source| RecordError::Create { path: path.to_owned(), source })?;
        Self::start_on(Box::new(file), metadata, options)
    }

    /// Starts recording on any [`Disk`].
    ///
    /// # Errors
    /// [`RecordError::Write`] when the file's beginning cannot be written or no thread can be started.
    pub fn start_on(
        disk: Box<dyn Disk>,
        metadata: &RecordingMetadata,
        options: RecorderOptions,
    ) -> Result<Self, RecordError> {
        let lanes = Lanes::default();
        let progress = Arc::new(WriteProgress::default());
        let metadata = metadata.stamped();
        let sink = Sink::create(PatientDisk::new(disk, Arc::clone(&progress)), metadata)?;
        let worker = Worker { lanes: Arc::clone(&lanes), progress: Arc::clone(&progress), options };
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || {
                rt::end_alone();
                leave_real_time();
                worker.run(sink)
            })
            .map_err(|error| RecordError::Write(error.into()))?;
        Ok(Self { lanes, progress, options, thread: Some(thread) })
    }

    /// A way in for one more thread. Allocates: ask for it at start-up.
    #[must_use]
    pub fn sender(&self) -> RecordSender {
        let lane = Arc::new(Lane::new(self.options.queue_records));
        self.lanes.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(&lane));
        RecordSender::new(lane)
    }

    /// What has been written so far.
    #[must_use]
    pub fn summary(&self) -> RecorderSummary {
        let lanes = self.lanes.lock().unwrap_or_else(PoisonError::into_inner);
        RecorderSummary {
            written: self.progress.written.load(Ordering::Relaxed),
            dropped: dropped(&lanes),
            disk_full_ns: self.progress.disk_full_ns.load(Ordering::Relaxed),
        }
    }

    /// Whether the disk has failed for good. Recording has ended; the loop goes on.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.progress.failed.load(Ordering::Relaxed)
    }

    /// Writes what is queued, closes the file and waits until it is on the medium.
    ///
    /// # Errors
    /// [`RecordError::Write`] when the disk failed or stayed full; the file then ends with its last whole chunk.
    pub fn finish(mut self) -> Result<RecorderSummary, RecordError> {
        self.close()?;
        Ok(self.summary())
    }

    fn close(&mut self) -> Result<(), RecordError> {
        self.progress.closing.store(true, Ordering::Relaxed);
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(RecordError::Write(io::Error::other("the recorder's thread died").into())),
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if let Err(error) = self.close() {
            tracing::error!("{error}");
        }
    }
}

fn dropped(lanes: &[Arc<Lane>]) -> u64 {
    lanes.iter().map(|lane| lane.dropped.load(Ordering::Relaxed)).sum()
}

/// The recorder must never compete with the loop: whoever started it, it runs at ordinary priority.
#[allow(unsafe_code, reason = "std sets no scheduler")]
fn leave_real_time() {
    let ordinary = libc::sched_param { sched_priority: 0 };
    // SAFETY: `ordinary` is a valid sched_param for the duration of the call; id 0 names this thread only.
    let code = unsafe { libc::sched_setscheduler(0, libc::SCHED_OTHER, &raw const ordinary) };
    if code != 0 {
        tracing::debug!("the recorder keeps its scheduling class: {}", io::Error::last_os_error());
    }
}

/// What the recorder's thread works on.
struct Worker {
    lanes: Lanes,
    progress: Arc<WriteProgress>,
    options: RecorderOptions,
}

impl Worker {
    fn run(&self, sink: Sink) -> Result<(), RecordError> {
        // A defect here is as a disk that fails: the recording ends, what is lost is counted, and nobody waits for it.
        let mut sink = ManuallyDrop::new(sink);
        let written = catch_unwind(AssertUnwindSafe(|| self.write_until_closed(&mut sink)));
        let panicked = || RecordError::Write(io::Error::other("the recorder panicked").into());
        let result = match written {
            Ok(written) => {
                let sink = ManuallyDrop::into_inner(sink);
                let ended = catch_unwind(AssertUnwindSafe(move || written.and_then(|()| sink.finish())));
                ended.unwrap_or_else(|_| Err(panicked()))
            }
            // The sink is left as it is: to end it would ask the same code again. The file is what `kill -9` would leave.
            Err(_) => Err(panicked()),
        };
        if let Err(error) = &result {
            tracing::error!("the recording has ended: {error}");
            self.count_what_is_lost();
        }
        result
    }

    fn write_until_closed(&self, sink: &mut Sink) -> Result<(), RecordError> {
        let chunk = Duration::from_millis(self.options.chunk_ms);
        let mut last_chunk = Instant::now();
        loop {
            // Read before draining: what was sent before the closing is still written.
            let closing = self.progress.closing.load(Ordering::Acquire);
            let lanes = self.lanes();
            let mut seen = 0;
            for lane in &lanes {
                // At most one queue's length, so that a busy lane cannot keep the others waiting.
                for _ in 0..lane.queue.capacity() {
                    let Some(record) = lane.queue.pop() else { break };
                    sink.write(&record)?;
                    self.progress.written.fetch_add(1, Ordering::Relaxed);
                    seen += 1;
                }
            }
            if closing && seen == 0 {
                return sink.write(&RecordedItem::Status(self.status(&lanes)));
            }
            if last_chunk.elapsed() >= chunk {
                sink.write(&RecordedItem::Status(self.status(&lanes)))?;
                sink.flush()?;
                last_chunk = Instant::now();
            }
            if seen == 0 {
                std::thread::sleep(POLL);
            }
        }
    }

    /// After a failure of the disk: keeps emptying the queues, so that every record lost is counted.
    fn count_what_is_lost(&self) {
        self.progress.failed.store(true, Ordering::Relaxed);
        loop {
            let closing = self.progress.closing.load(Ordering::Acquire);
            for lane in self.lanes() {
                let lost = std::iter::from_fn(|| lane.queue.pop()).take(lane.queue.capacity()).count();
                lane.dropped.fetch_add(lost as u64, Ordering::Relaxed);
            }
            if closing {
                return;
            }
            std::thread::sleep(POLL);
        }
    }

    fn lanes(&self) -> Vec<Arc<Lane>> {
        self.lanes.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn status(&self, lanes: &[Arc<Lane>]) -> RecorderStatus {
        RecorderStatus {
            stamp_ns: monotonic_ns(),
            written: self.progress.written.load(Ordering::Relaxed),
            dropped: dropped(lanes),
            disk_full_ns: self.progress.disk_full_ns.load(Ordering::Relaxed),
        }
    }
}
