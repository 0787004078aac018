//! The guard's events, in a ring of fixed size: nothing is allocated, what does not fit is counted.

use crate::signal::GuardEvent;

/// Events kept between two drains; each cycle drains.
const CAPACITY: usize = 64;

/// Oldest first; a full ring drops the newest, since the first cause is the one that matters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct EventRing {
    slots: [GuardEvent; CAPACITY],
    first: usize,
    length: usize,
    sequence: u64,
    dropped: u64,
}

impl EventRing {
    pub(super) fn new() -> Self {
        Self { slots: [GuardEvent::default(); CAPACITY], first: 0, length: 0, sequence: 0, dropped: 0 }
    }

    /// Numbers the event and keeps it, or counts it as dropped.
    pub(super) fn push(&mut self, event: GuardEvent) {
        self.sequence += 1;
        let free = self.length < CAPACITY;
        match self.slots.get_mut((self.first + self.length) % CAPACITY).filter(|_| free) {
            Some(slot) => {
                *slot = GuardEvent { sequence: self.sequence, ..event };
                self.length += 1;
            }
            None => self.dropped += 1,
        }
    }

    pub(super) fn pop(&mut self) -> Option<GuardEvent> {
        if self.length == 0 {
            return None;
        }
        let event = self.slots.get(self.first).copied();
        self.first = (self.first + 1) % CAPACITY;
        self.length -= 1;
        event
    }

    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }
}
