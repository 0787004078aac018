//! A node without an id that asks for one: `uavcan.protocol.dynamic_node_id.Allocation`, rules A to E.

use crate::can::error::CanError;
use crate::can::frame::Frame;
use crate::can::thresholds::THRESHOLDS;

use super::allocation::{AllocationMessage, LONGEST, PART, UNIQUE, UniqueId, subscription};
use super::assembler::{Assembler, Subscription};
use super::library::Library;
use super::participant::Participant;
use super::transfer::{GREATEST_NODE, TransferFrames, TransferHeader, TransferId, TransferKind, priority};

/// Asks for a node id.
#[derive(Debug)]
pub struct Allocatee {
    unique_id: UniqueId,
    wished: u8,
    subscription: Subscription,
    assembler: Assembler,
    transfer_id: TransferId,
    /// State of the draws.
    seed: u64,
    /// [ns] when it asks anew; `None` = not begun.
    request_ns: Option<u64>,
    /// [ns] when the part of the unique id that begins there is said.
    follow_up: Option<(u64, usize)>,
    /// What it was given, and by whom.
    given: Option<(u8, u8)>,
    /// An allocator that was heard, whomever it answered.
    allocator: Option<u8>,
}

impl Allocatee {
    /// Asks as the node with this unique id, for the id `wished`, or any (0).
    ///
    /// # Errors
    /// None for the types that come with the crate.
    pub fn new(unique_id: UniqueId, wished: u8) -> Result<Self, CanError> {
        Ok(Self::with(subscription(&Library::build(&[])?)?, unique_id, wished))
    }

    /// The same, where the message is known already.
    pub(super) fn with(subscription: Subscription, unique_id: UniqueId, wished: u8) -> Self {
        // Nodes that begin at the same time must not draw the same.
        let seed = unique_id.0.iter().fold(0xCBF2_9CE4_8422_2325_u64, |seed, byte| {
            (seed ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        });
        Self {
            unique_id,
            wished,
            subscription,
            assembler: Assembler::new(vec![subscription]),
            transfer_id: TransferId::default(),
            seed,
            request_ns: None,
            follow_up: None,
            given: None,
            allocator: None,
        }
    }

    /// The node id that it was given, and the allocator's own.
    #[must_use]
    pub fn given(&self) -> Option<(u8, u8)> {
        self.given
    }

    /// An allocator that was heard, whomever it answered.
    #[must_use]
    pub fn allocator(&self) -> Option<u8> {
        self.allocator
    }

    /// A number below `limit`.
    fn draw(&mut self, limit: u64) -> u64 {
        // Knuth's linear congruential generator, MMIX; its high bits are the better ones.
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.seed >> 33) % limit.max(1)
    }

    fn wait_for_request(&mut self, now_ns: u64) {
        let wait_ns = THRESHOLDS.request_ns + self.draw(THRESHOLDS.request_drawn_ns);
        self.request_ns = Some(now_ns.saturating_add(wait_ns));
    }

    /// The frame with the part of the unique id that begins at `from`.
    fn part(&mut self, from: usize) -> Option<Frame> {
        let to = (from + PART).min(UNIQUE);
        let discriminator = self.draw(1 << 14) as u16;
        let unique_id = self.unique_id.0.get(from..to)?;
        let payload = AllocationMessage { node_id: self.wished, is_first_part: from == 0, unique_id }.emit();
        let header = TransferHeader {
            priority: priority::LOW,
            type_id: self.subscription.type_id,
            source: 0,
            kind: TransferKind::Message,
            discriminator,
        };
        TransferFrames::new(header, self.subscription.seed, self.transfer_id.take(), &payload).next()
    }
}

impl Participant for Allocatee {
    fn receive(&mut self, frame: &Frame, now_ns: u64) {
        let Ok(Some(transfer)) = self.assembler.receive(frame, now_ns) else { return };
        let source = transfer.header.source;
        let mut room = [0; LONGEST];
        let Some(message) = AllocationMessage::of_transfer(&transfer, &mut room) else { return };
        let (node_id, heard) = (message.node_id, message.unique_id.len());
        let is_ours = source != 0 && self.unique_id.0.starts_with(message.unique_id);
        // Whatever is said interrupts what was to follow (rules C and D).
        self.follow_up = None;
        self.wait_for_request(now_ns);
        if source == 0 {
            return;
        }
        self.allocator = Some(source);
        if is_ours && heard < UNIQUE {
            let wait_ns = self.draw(THRESHOLDS.follow_up_drawn_ns);
            self.follow_up = Some((now_ns.saturating_add(wait_ns), heard));
        } else if is_ours && (1..=GREATEST_NODE).contains(&node_id) {
            self.given = Some((node_id, source));
        }
    }

    fn due_frames(&mut self, now_ns: u64) -> Vec<Frame> {
        if self.given.is_some() {
            return Vec::new();
        }
        let Some(request_ns) = self.request_ns else {
            self.wait_for_request(now_ns);
            return Vec::new();
        };
        if let Some((at_ns, from)) = self.follow_up {
            if now_ns < at_ns {
                return Vec::new();
            }
            self.follow_up = None;
            return self.part(from).into_iter().collect();
        }
        if now_ns < request_ns {
            return Vec::new();
        }
        self.wait_for_request(now_ns);
        self.part(0).into_iter().collect()
    }
}
