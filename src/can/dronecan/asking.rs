//! Emulated nodes that have no id yet: one after the other asks an allocator, as if they were plugged in one after the other.

use std::collections::VecDeque;

use crate::can::frame::Frame;

use super::allocatee::Allocatee;
use super::allocation::UniqueId;
use super::assembler::Subscription;
use super::participant::Participant;

/// The nodes without an id, by their places, the one that asks first.
#[derive(Debug, Default)]
pub(super) struct Asking {
    nodes: VecDeque<(usize, Allocatee)>,
}

impl Asking {
    /// These nodes ask, each for the id that it would have by itself.
    pub fn new(subscription: Subscription, nodes: impl Iterator<Item = (usize, UniqueId, u8)>) -> Self {
        let ask = |(place, unique_id, wished)| (place, Allocatee::with(subscription, unique_id, wished));
        Self { nodes: nodes.map(ask).collect() }
    }

    /// How many have none yet.
    pub fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Takes in a frame of somebody else; the place of a node that has got its id with it, and the id.
    pub fn receive(&mut self, frame: &Frame, now_ns: u64) -> Option<(usize, u8)> {
        let (place, first) = self.nodes.front_mut()?;
        first.receive(frame, now_ns);
        let given = (*place, first.given()?.0);
        self.nodes.pop_front();
        Some(given)
    }

    /// What is to be sent at `now_ns`.
    pub fn due_frames(&mut self, now_ns: u64) -> Vec<Frame> {
        self.nodes.front_mut().map_or_else(Vec::new, |(_, first)| first.due_frames(now_ns))
    }
}
