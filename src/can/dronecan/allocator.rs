//! The one who gives node ids to nodes without: a central allocator, as the specification has it for a bus with one.

use std::collections::{BTreeMap, VecDeque};
use std::io;

use crate::can::error::CanError;
use crate::can::frame::Frame;
use crate::can::resolve::fail;
use crate::can::thresholds::THRESHOLDS;

use super::allocation::{AllocationMessage, LONGEST, PART, UNIQUE, UniqueId, subscription};
use super::assembler::{Assembler, Subscription};
use super::library::Library;
use super::node_monitor::NodeMonitor;
use super::participant::Participant;
use super::transfer::{GREATEST_NODE, TransferFrames, TransferHeader, TransferId, priority};

/// Who has which node id.
pub type AllocationTable = BTreeMap<UniqueId, u8>;

/// What an allocator did.
#[derive(Debug)]
pub enum AllocationEvent {
    /// Gave a node its id.
    Given {
        /// The node.
        unique_id: UniqueId,
        /// The id.
        node_id: u8,
        /// Whether it had none before.
        is_new: bool,
    },
    /// Had no id left for a node.
    NoneLeft {
        /// The node.
        unique_id: UniqueId,
    },
    /// Could not keep its table, and gave none.
    NotKept {
        /// Why.
        error: io::Error,
    },
    /// Heard another allocator, and is silent from then on.
    NotAlone {
        /// Its node id.
        node: u8,
    },
}

/// Keeps the table; asked before an id is given, as what is not remembered may be given twice.
pub type Keep<'a> = Box<dyn FnMut(&AllocationTable) -> io::Result<()> + 'a>;

/// Gives node ids.
pub struct NodeIdAllocator<'a> {
    own: u8,
    from: u8,
    to: u8,
    table: AllocationTable,
    keep: Keep<'a>,
    subscription: Subscription,
    assembler: Assembler,
    transfer_id: TransferId,
    /// Who else is on the bus.
    monitor: NodeMonitor,
    /// Bytes of a unique id heard so far, and when the last of them came [ns].
    query: Vec<u8>,
    query_ns: u64,
    frames: Vec<Frame>,
    events: VecDeque<AllocationEvent>,
    /// Another allocator.
    other: Option<u8>,
}

impl std::fmt::Debug for NodeIdAllocator<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("NodeIdAllocator")
            .field("own", &self.own)
            .field("table", &self.table)
            .finish_non_exhaustive()
    }
}

impl<'a> NodeIdAllocator<'a> {
    /// Gives ids of `from` to `to` beside those of `table`, as the node that asks in `monitor`, which knows who is on the bus.
    ///
    /// # Errors
    /// [`CanError::Role`] when one is no node id, or there is none to give.
    pub fn new(
        monitor: NodeMonitor,
        (from, to): (u8, u8),
        table: AllocationTable,
        keep: Keep<'a>,
    ) -> Result<Self, CanError> {
        let is_node = |id: &u8| (1..=GREATEST_NODE).contains(id);
        if !is_node(&from) || !is_node(&to) || from > to {
            let reason = format!("{from} to {to} are no node ids of 1 to {GREATEST_NODE}");
            return Err(fail("dronecan.node_id", reason));
        }
        let subscription = subscription(&Library::build(&[])?)?;
        Ok(Self {
            own: monitor.own(),
            from,
            to,
            table,
            keep,
            subscription,
            assembler: Assembler::new(vec![subscription]),
            transfer_id: TransferId::default(),
            monitor,
            query: Vec::with_capacity(UNIQUE),
            query_ns: 0,
            frames: Vec::new(),
            events: VecDeque::new(),
            other: None,
        })
    }

    /// What it did, the oldest first, each once.
    pub fn take_event(&mut self) -> Option<AllocationEvent> {
        self.events.pop_front()
    }

    /// Who has which id.
    #[must_use]
    pub fn table(&self) -> &AllocationTable {
        &self.table
    }

    /// Takes in what a node without an id says.
    fn ask(&mut self, message: AllocationMessage<'_>, now_ns: u64) {
        if now_ns.saturating_sub(self.query_ns) > THRESHOLDS.allocation_part_ns {
            self.query.clear();
        }
        let part = message.unique_id;
        match (message.is_first_part, self.query.len(), part.len()) {
            (true, _, PART) => self.query.clear(),
            (false, PART, PART) => {}
            (false, heard, rest) if heard == 2 * PART && rest == UNIQUE - 2 * PART => {}
            _ => return,
        }
        self.query.extend_from_slice(part);
        self.query_ns = now_ns;
        let Ok(whole) = <[u8; UNIQUE]>::try_from(self.query.as_slice()) else {
            self.say(0);
            return;
        };
        if let Some(node_id) = self.give(UniqueId(whole), message.node_id) {
            self.say(node_id);
        }
        self.query.clear();
    }

    /// Says what was heard, with the id that is given.
    fn say(&mut self, node_id: u8) {
        let payload = AllocationMessage { node_id, is_first_part: false, unique_id: &self.query }.emit();
        let header = TransferHeader::message(priority::LOW, self.subscription.type_id, self.own);
        self.frames.extend(TransferFrames::new(
            header,
            self.subscription.seed,
            self.transfer_id.take(),
            &payload,
        ));
    }

    fn give(&mut self, unique_id: UniqueId, wished: u8) -> Option<u8> {
        let others = self.others(unique_id);
        let known = self.table.get(&unique_id).copied().filter(|id| *id != self.own && !others.contains(id));
        let Some(node_id) = known.or_else(|| self.free(wished, &others)) else {
            self.events.push_back(AllocationEvent::NoneLeft { unique_id });
            return None;
        };
        if known.is_none() {
            let before = self.table.insert(unique_id, node_id);
            if let Err(error) = (self.keep)(&self.table) {
                match before {
                    Some(before) => self.table.insert(unique_id, before),
                    None => self.table.remove(&unique_id),
                };
                self.events.push_back(AllocationEvent::NotKept { error });
                return None;
            }
        }
        self.events.push_back(AllocationEvent::Given { unique_id, node_id, is_new: known.is_none() });
        Some(node_id)
    }

    /// Ids of nodes that are known to be others than the one with this unique id.
    fn others(&self, unique_id: UniqueId) -> Vec<u8> {
        let is_other = |info: &super::node_monitor::NodeInfo| info.unique_id != unique_id.0;
        let reports = self.monitor.nodes().into_iter();
        reports.filter(|it| it.info.as_ref().is_some_and(is_other)).map(|it| it.id).collect()
    }

    /// The id that is wished or the next free one above; else the highest that is free.
    fn free(&self, wished: u8, others: &[u8]) -> Option<u8> {
        let heard: Vec<u8> = self.monitor.nodes().iter().map(|it| it.id).collect();
        let is_free = |id: &u8| {
            *id != self.own
                && !heard.contains(id)
                && !others.contains(id)
                && !self.table.values().any(|known| known == id)
        };
        let above = (wished.max(self.from)..=self.to).find(is_free).filter(|_| wished != 0);
        above.or_else(|| (self.from..=self.to).rev().find(is_free))
    }
}

impl Participant for NodeIdAllocator<'_> {
    fn receive(&mut self, frame: &Frame, now_ns: u64) {
        self.monitor.receive(frame, now_ns);
        let Ok(Some(transfer)) = self.assembler.receive(frame, now_ns) else { return };
        let source = transfer.header.source;
        if source != 0 {
            if self.other.is_none() {
                self.other = Some(source);
                self.events.push_back(AllocationEvent::NotAlone { node: source });
            }
            return;
        }
        if self.other.is_some() {
            return;
        }
        let mut room = [0; LONGEST];
        let Some(message) = AllocationMessage::of_transfer(&transfer, &mut room) else { return };
        let mut part = [0; UNIQUE];
        let Some(unique_id) = part.get_mut(..message.unique_id.len()) else { return };
        unique_id.copy_from_slice(message.unique_id);
        let AllocationMessage { node_id, is_first_part, .. } = message;
        self.ask(AllocationMessage { node_id, is_first_part, unique_id }, now_ns);
    }

    fn due_frames(&mut self, now_ns: u64) -> Vec<Frame> {
        let mut frames = self.monitor.due_frames(now_ns);
        frames.append(&mut self.frames);
        frames
    }
}
