//! One writer, many readers, a ring of the last values: built from the entries of an iceoryx2 blackboard.
//!
//! iceoryx2's publish-subscribe allocates for every sample it sends; a blackboard entry does not, nor does it make
//! the writer wait. A ring of entries, each holding its own number, adds what a blackboard lacks: a reader that
//! wants every value gets every value, and one that falls a whole ring behind knows how many it lost.

use std::sync::Arc;

use crossbeam::queue::ArrayQueue;
use iceoryx2::node::Node;
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::{ServiceName, ZeroCopySend, ipc_threadsafe};

use super::claim::Claim;
use super::kept::Kept;
use super::topic::{ProcessRole, Shareable, Topic};
use super::{BenchPlace, ShmError};
use crate::rt;

type Service = ipc_threadsafe::Service;

/// Key of the entry that holds the number of the newest value; the others are slots of the ring.
const HEAD: u32 = u32::MAX;
const MAX_READERS: usize = 32;

/// A value and its number, counted from 1; 0 = never written.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
struct Slot<T> {
    number: u64,
    value: T,
}

// SAFETY: `repr(C)`, an integer and a value that is itself fit for shared memory. The name is the value's, so that a
// reader of another type is refused.
#[allow(unsafe_code, reason = "what iceoryx2 asks of a type in shared memory")]
unsafe impl<T: ZeroCopySend> ZeroCopySend for Slot<T> {
    unsafe fn type_name() -> &'static str {
        // SAFETY: the value's own promise.
        unsafe { <T as ZeroCopySend>::type_name() }
    }
}

/// The one writer of a topic. [`Publisher::send`] neither allocates nor waits.
pub struct Publisher<T: Shareable> {
    newest: u64,
    head: Kept<EntryHandleMut<Service, u32, u64>>,
    slots: Kept<Vec<EntryHandleMut<Service, u32, Slot<T>>>>,
    _writer: Kept<Writer<Service, u32>>,
    _claim: Claim,
}

impl<T: Shareable> std::fmt::Debug for Publisher<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Publisher").field("newest", &self.newest).finish_non_exhaustive()
    }
}

impl<T: Shareable> Publisher<T> {
    pub(super) fn create(
        node: &Node<Service>,
        place: &BenchPlace,
        topic: &Topic<T>,
        role: ProcessRole,
    ) -> Result<Self, ShmError> {
        let mut claim = Claim::take(place, topic.name(), role)?;
        let failed = |what: String| ShmError::Service { topic: topic.name().to_owned(), what };
        let name = service_name(topic.name(), claim.incarnation())?;
        let depth = topic.depth();
        let mut creator = node
            .service_builder(&name)
            .blackboard_creator::<u32>()
            .max_readers(MAX_READERS)
            .max_nodes(MAX_READERS);
        creator = creator.add_with_default::<u64>(HEAD);
        for key in 0..depth {
            creator = creator.add_with_default::<Slot<T>>(key);
        }
        let service = creator.create().map_err(|error| failed(error.to_string()))?;
        let writer = service.writer_builder().create().map_err(|error| failed(error.to_string()))?;
        let head = writer.entry(&HEAD).map_err(|error| failed(error.to_string()))?;
        let mut slots = (0..depth)
            .map(|key| writer.entry(&key).map_err(|error| failed(error.to_string())))
            .collect::<Result<Vec<_>, _>>()?;
        // Written to once before anybody can know of it: else each cycle of the first pass through the ring would meet pages that
        // were never written to, locked or not, and a page fault is as long as the rest of the way of a frame. Twice, because
        // an entry writes its two places in turn.
        for _ in 0..2 {
            slots.iter_mut().for_each(|slot| slot.update_with_copy(Slot::default()));
        }
        place.set_access()?;
        claim.announce()?;
        let (head, slots, writer) = (Kept::new(head), Kept::new(slots), Kept::new(writer));
        Ok(Self { newest: 0, head, slots, _writer: writer, _claim: claim })
    }

    /// Publishes `value`.
    pub fn send(&mut self, value: &T) {
        if rt::memory_is_lost() {
            return;
        }
        let at = (self.newest % self.slots.len() as u64) as usize;
        self.newest += 1;
        if let Some(slot) = self.slots.get(at) {
            slot.update_with_copy(Slot { number: self.newest, value: *value });
            self.head.update_with_copy(self.newest);
        }
    }
}

/// One incarnation of a topic, as a reader holds it.
pub(super) struct Incarnation<T: Shareable> {
    head: Kept<EntryHandle<Service, u32, u64>>,
    slots: Kept<Vec<EntryHandle<Service, u32, Slot<T>>>>,
    _reader: Kept<Reader<Service, u32>>,
}

impl<T: Shareable> Incarnation<T> {
    pub(super) fn open(node: &Node<Service>, topic: &Topic<T>, incarnation: &str) -> Result<Self, ShmError> {
        let failed = |what: String| ShmError::Service { topic: topic.name().to_owned(), what };
        let name = service_name(topic.name(), incarnation)?;
        let service = node
            .service_builder(&name)
            .blackboard_opener::<u32>()
            .open()
            .map_err(|error| failed(error.to_string()))?;
        let reader = service.reader_builder().create().map_err(|error| failed(error.to_string()))?;
        let head = reader.entry(&HEAD).map_err(|error| failed(error.to_string()))?;
        let slots = (0..topic.depth())
            .map(|key| reader.entry(&key).map_err(|error| failed(error.to_string())))
            .collect::<Result<Vec<_>, _>>()?;
        let opened = Self { head: Kept::new(head), slots: Kept::new(slots), _reader: Kept::new(reader) };
        // Looked at once here, where nobody waits for it: else the cycles of the first pass would meet the page faults.
        for number in 1..=u64::from(topic.depth()) {
            std::hint::black_box(opened.slot(number));
        }
        Ok(opened)
    }

    fn newest(&self) -> u64 {
        if rt::memory_is_lost() { 0 } else { *self.head.get() }
    }

    /// The slot where value `number` belongs; it may hold an older or a newer one. An empty one where the memory was taken
    /// away, be it by this very look.
    fn slot(&self, number: u64) -> Slot<T> {
        if rt::memory_is_lost() {
            return Slot::default();
        }
        let at = (number.wrapping_sub(1) % self.slots.len() as u64) as usize;
        let slot = self.slots.get(at).map_or_else(Slot::default, |entry| *entry.get());
        if rt::memory_is_lost() { Slot::default() } else { slot }
    }
}

fn service_name(topic: &str, incarnation: &str) -> Result<ServiceName, ShmError> {
    ServiceName::new(&format!("{topic}/{incarnation}"))
        .map_err(|error| ShmError::Service { topic: topic.to_owned(), what: error.to_string() })
}

/// A reader of a topic, through all incarnations of its publisher. Neither of its two reads allocates, waits or locks.
pub struct Subscriber<T: Shareable> {
    incarnation: Option<Incarnation<T>>,
    /// Number of the value to be read next.
    next: u64,
    lost: u64,
    incarnations: u64,
    arriving: Arc<ArrayQueue<Incarnation<T>>>,
    leaving: Arc<ArrayQueue<Incarnation<T>>>,
}

impl<T: Shareable> std::fmt::Debug for Subscriber<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { next, lost, incarnations, .. } = self;
        formatter
            .debug_struct("Subscriber")
            .field("next", next)
            .field("lost", lost)
            .field("incarnations", incarnations)
            .finish_non_exhaustive()
    }
}

impl<T: Shareable> Subscriber<T> {
    pub(super) fn new(
        incarnation: Option<Incarnation<T>>,
        arriving: Arc<ArrayQueue<Incarnation<T>>>,
        leaving: Arc<ArrayQueue<Incarnation<T>>>,
    ) -> Self {
        // Who comes late starts with the newest value, not with the history.
        let next = incarnation.as_ref().map_or(1, |incarnation| incarnation.newest().max(1));
        let incarnations = u64::from(incarnation.is_some());
        Self { incarnation, next, lost: 0, incarnations, arriving, leaving }
    }

    /// The newest value, if it was not read before; older ones are passed over.
    pub fn newest(&mut self) -> Option<T> {
        self.adopt();
        let incarnation = self.incarnation.as_ref()?;
        let newest = incarnation.newest();
        if newest < self.next {
            return None;
        }
        let slot = incarnation.slot(newest);
        if slot.number < self.next {
            return None;
        }
        self.next = slot.number + 1;
        Some(slot.value)
    }

    /// The next value in order; `None` when there is no newer one yet. A incarnation that ended is read to its end
    /// before its successor.
    pub fn next_in_order(&mut self) -> Option<T> {
        if let Some(value) = self.next_of_this_life() {
            return Some(value);
        }
        if self.adopt() { self.next_of_this_life() } else { None }
    }

    fn next_of_this_life(&mut self) -> Option<T> {
        let incarnation = self.incarnation.as_ref()?;
        loop {
            let slot = incarnation.slot(self.next);
            if slot.number < self.next {
                return None;
            }
            if slot.number == self.next {
                self.next += 1;
                return Some(slot.value);
            }
            // Overtaken: go on in the younger half of the ring, which the writer reaches last.
            let onward =
                (slot.number + 1).saturating_sub(incarnation.slots.len() as u64 / 2).max(self.next + 1);
            self.lost += onward - self.next;
            self.next = onward;
        }
    }

    /// Number of values that [`Subscriber::next_in_order`] could not get because it came too late.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Number of publishers met so far, one after the other: a restart shows as one more.
    #[must_use]
    pub fn incarnations(&self) -> u64 {
        self.incarnations
    }

    /// Takes over the newest incarnation the watch thread has opened, if there is one.
    fn adopt(&mut self) -> bool {
        let mut adopted = false;
        while let Some(incarnation) = self.arriving.pop() {
            adopted = true;
            self.next = 1;
            self.incarnations += 1;
            if let Some(old) = self.incarnation.replace(incarnation) {
                // The watch thread closes it; should its queue be full, it is closed here.
                drop(self.leaving.push(old));
            }
        }
        adopted
    }
}
