//! How a cycle says something: a fixed-size record into a bounded queue, formatted by another thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam::queue::ArrayQueue;

use super::shutdown::end_alone;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// For information.
    Info,
    /// Something to look into.
    Warning,
    /// Something does not work.
    Error,
}

/// What a cycle says: a constant sentence and a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogLine {
    /// How bad it is.
    pub severity: Severity,
    /// The sentence.
    pub text: &'static str,
    /// The number it speaks of.
    pub value: f64,
}

/// The cycle's end of the queue.
#[derive(Debug, Clone)]
pub struct LogQueue {
    lines: Arc<ArrayQueue<LogLine>>,
    dropped: Arc<AtomicU64>,
}

impl LogQueue {
    /// A queue for `capacity` lines (at least 1).
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self { lines: Arc::new(ArrayQueue::new(capacity.max(1))), dropped: Arc::default() }
    }

    /// Says it, or counts it as dropped when the queue is full. Never waits, never allocates.
    pub fn say(&self, severity: Severity, text: &'static str, value: f64) {
        if self.lines.push(LogLine { severity, text, value }).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The oldest line not taken yet.
    #[must_use]
    pub fn take(&self) -> Option<LogLine> {
        self.lines.pop()
    }

    /// Number of lines dropped so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// The thread that writes the lines into the log. To be started before the real-time set-up, whose priority it
/// would inherit.
#[derive(Debug)]
pub struct LogWriter {
    queue: LogQueue,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl LogWriter {
    /// Starts the thread.
    ///
    /// # Errors
    /// The operating system's when it has no thread to give.
    pub fn start(capacity: usize) -> std::io::Result<Self> {
        let queue = LogQueue::new(capacity);
        let stop = Arc::new(AtomicBool::new(false));
        let thread = std::thread::Builder::new().name("log-writer".to_owned()).spawn({
            let (queue, stop) = (queue.clone(), Arc::clone(&stop));
            move || {
                end_alone();
                while !stop.load(Ordering::Relaxed) {
                    write_all(&queue);
                    std::thread::park_timeout(Duration::from_millis(50));
                }
                write_all(&queue);
            }
        })?;
        Ok(Self { queue, stop, thread: Some(thread) })
    }

    /// The cycle's end.
    #[must_use]
    pub fn queue(&self) -> LogQueue {
        self.queue.clone()
    }
}

impl Drop for LogWriter {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
        if self.queue.dropped() > 0 {
            tracing::warn!(dropped = self.queue.dropped(), "log lines of the cycle were dropped");
        }
    }
}

fn write_all(queue: &LogQueue) {
    while let Some(LogLine { severity, text, value }) = queue.take() {
        match severity {
            Severity::Info => tracing::info!(value, "{text}"),
            Severity::Warning => tracing::warn!(value, "{text}"),
            Severity::Error => tracing::error!(value, "{text}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_queue_drops_and_counts() {
        let queue = LogQueue::new(2);
        for value in 0..5 {
            queue.say(Severity::Info, "line", f64::from(value));
        }
        assert_eq!(queue.dropped(), 3);
        assert_eq!(queue.take().map(|line| line.value), Some(0.0));
        assert_eq!(queue.take().map(|line| line.value), Some(1.0));
        assert_eq!(queue.take(), None);
    }
}
