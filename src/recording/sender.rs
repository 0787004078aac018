//! The sending side of the recorder: what a real-time thread holds.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crossbeam::queue::ArrayQueue;

use crate::signal::{
    Applied, Command, ControlStep, CycleSample, GuardEvent, GuardStep, Heartbeat, Request, Sensors,
};

use super::messages::RecorderStatus;
use super::raw_frame::RawFrame;

/// Anything a recording holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RecordedItem {
    /// A publication of the sensors.
    Sensors(Sensors),
    /// What the controller wanted.
    Command(Command),
    /// What the guard let through.
    Applied(Applied),
    /// An operator's act.
    Request(Request),
    /// A transition or refusal of the guard.
    GuardEvent(GuardEvent),
    /// A process's pulse.
    Heartbeat(Heartbeat),
    /// Statistics of one cycle.
    Cycle(CycleSample),
    /// A frame on the bus.
    Frame(RawFrame),
    /// One controller step with all it consumed.
    ControlStep(ControlStep),
    /// One guard period with all it consumed.
    GuardStep(GuardStep),
    /// What the recorder says about itself; written by the recorder only.
    Status(RecorderStatus),
}

macro_rules! record_from {
    ($($variant:ident : $message:ty),* $(,)?) => {$(
        impl From<$message> for RecordedItem {
            fn from(message: $message) -> Self {
                Self::$variant(message)
            }
        }
    )*};
}
record_from!(
    Sensors: Sensors, Command: Command, Applied: Applied, Request: Request, GuardEvent: GuardEvent,
    Heartbeat: Heartbeat, Cycle: CycleSample, Frame: RawFrame, ControlStep: ControlStep, GuardStep: GuardStep,
    Status: RecorderStatus,
);

impl RecordedItem {
    /// [ns] CLOCK_MONOTONIC of what it records.
    #[must_use]
    pub fn stamp_ns(&self) -> u64 {
        match self {
            Self::Sensors(it) => it.stamp_ns,
            Self::Command(it) => it.stamp_ns,
            Self::Applied(it) => it.stamp_ns,
            Self::Request(it) => it.stamp_ns,
            Self::GuardEvent(it) => it.stamp_ns,
            Self::Heartbeat(it) => it.stamp_ns,
            Self::Cycle(it) => it.finished_ns,
            Self::Frame(it) => it.stamp_ns,
            Self::ControlStep(it) => it.command.stamp_ns.max(it.sensors.stamp_ns),
            Self::GuardStep(it) => it.now_ns,
            Self::Status(it) => it.stamp_ns,
        }
    }
}

/// The queue of one thread, shared with the recorder's thread.
#[derive(Debug)]
pub(crate) struct Lane {
    pub(crate) queue: ArrayQueue<RecordedItem>,
    /// Records refused because the queue was full.
    pub(crate) dropped: AtomicU64,
}

impl Lane {
    pub(crate) fn new(records: usize) -> Self {
        Self { queue: ArrayQueue::new(records.max(4)), dropped: AtomicU64::new(0) }
    }
}

/// One thread's way into the recorder. Sending neither waits, locks, allocates nor calls the kernel; when the
/// queue is full the record is refused and counted.
///
/// Not `Clone`: each thread asks the recorder for its own, so that each queue has one sender.
#[derive(Debug)]
pub struct RecordSender {
    lane: Option<Arc<Lane>>,
}

impl RecordSender {
    pub(crate) fn new(lane: Arc<Lane>) -> Self {
        Self { lane: Some(lane) }
    }

    /// A sender that records nothing: for a process run without a recording.
    #[must_use]
    pub fn off() -> Self {
        Self { lane: None }
    }

    /// Hands `record` to the recorder. Returns whether it was taken.
    pub fn send(&mut self, record: impl Into<RecordedItem>) -> bool {
        let Some(lane) = &self.lane else { return true };
        // One slot always stays free. Were the queue filled to the brim, `push` could meet the one slot the
        // recorder is just emptying and spin for it: forever, if this is a real-time thread that has
        // interrupted the recorder on the same core.
        let has_room = lane.queue.len() + 1 < lane.queue.capacity();
        let taken = has_room && lane.queue.push(record.into()).is_ok();
        if !taken {
            lane.dropped.fetch_add(1, Ordering::Relaxed);
        }
        taken
    }

    /// Hands `record` over, waiting while the queue is full: for benches on virtual time, never for a real one.
    pub fn send_patiently(&mut self, record: impl Into<RecordedItem>) {
        let Some(lane) = &self.lane else { return };
        let record = record.into();
        while lane.queue.len() + 1 >= lane.queue.capacity() {
            std::thread::sleep(Duration::from_micros(200));
        }
        self.send(record);
    }

    /// Counts records that were lost on their way here.
    pub fn count_lost(&mut self, records: u64) {
        if let Some(lane) = &self.lane {
            lane.dropped.fetch_add(records, Ordering::Relaxed);
        }
    }

    /// Records refused so far because the queue was full.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.lane.as_ref().map_or(0, |lane| lane.dropped.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_queue_refuses_and_counts_and_keeps_a_slot_free() {
        let lane = Arc::new(Lane::new(8));
        let mut sender = RecordSender::new(Arc::clone(&lane));
        let taken = (0..20).filter(|_| sender.send(Request::default())).count();
        assert_eq!(taken, 7);
        assert_eq!(sender.dropped(), 13);
        assert!(lane.queue.pop().is_some());
        assert!(sender.send(Request::default()));
    }

    #[test]
    fn a_handle_that_is_off_takes_everything() {
        let mut sender = RecordSender::off();
        assert!(sender.send(Sensors::default()));
        assert_eq!(sender.dropped(), 0);
    }
}
