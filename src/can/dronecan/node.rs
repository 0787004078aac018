//! What every node owes the bus: once a second how it is, and what it is when it is asked.

use crate::can::frame::Frame;
use crate::clock::NANOSECONDS_PER_SECOND;

use super::allocation::{UNIQUE, UniqueId};
use super::common::Common;
use super::crc;
use super::service::Service;
use super::store::MOST_ANSWER;
use super::transfer::{TransferFrames, TransferHeader, TransferId, TransferKind, priority};

/// [ns] between two of a node's `NodeStatus`.
pub(super) const STATUS_EVERY_NS: u64 = NANOSECONDS_PER_SECOND;
/// [ns] between two `ArmingStatus`, where the state stays.
pub(super) const ARMING_EVERY_NS: u64 = NANOSECONDS_PER_SECOND / 2;
/// [byte] of a `NodeStatus`.
const STATUS_BYTES: usize = 7;
/// Frames of an answer that are sent in one go.
pub(super) const AT_ONCE: usize = 2;

/// A node of ours.
#[derive(Debug, Clone)]
pub(super) struct Node {
    /// 0 = it has none yet, and is silent.
    pub id: u8,
    common: Common,
    /// [ns] of its first status, and when the next one is due.
    born_ns: Option<u64>,
    due_ns: u64,
    status_id: TransferId,
    seed: u16,
    /// The response to `GetNodeInfo`, and the frames of an answer that are still to be sent.
    info: Vec<u8>,
    answer: Vec<Frame>,
    answered: usize,
}

impl Node {
    /// The node with this id, `name` and a unique id of its own on this bus.
    pub fn new(common: &Common, id: u8, name: &str) -> Self {
        Self::with_unique_id(common, id, name, Self::unique_id(id))
    }

    /// The unique id of a node of ours that has this id by itself.
    pub fn unique_id(id: u8) -> UniqueId {
        let mut unique_id = UniqueId([0; UNIQUE]);
        let unique = b"rotorbench".iter().chain(std::iter::once(&id));
        unique_id.0.iter_mut().zip(unique).for_each(|(place, byte)| *place = *byte);
        unique_id
    }

    /// The same with this unique id.
    pub fn with_unique_id(common: &Common, id: u8, name: &str, unique_id: UniqueId) -> Self {
        let mut info = common.info.clone();
        let place = info.iter_mut().skip(common.unique_id);
        place.zip(unique_id.0).for_each(|(place, byte)| *place = byte);
        info.extend_from_slice(name.as_bytes());
        let answer = Vec::with_capacity(TransferFrames::count(info.len().max(MOST_ANSWER)));
        let seed = crc::transfer_seed(common.info_signature);
        Self {
            id,
            common: common.clone(),
            born_ns: None,
            due_ns: 0,
            status_id: TransferId::default(),
            seed,
            info,
            answered: 0,
            answer,
        }
    }

    /// [ns] when it has something to say.
    pub fn due_ns(&self) -> u64 {
        if self.id == 0 {
            u64::MAX
        } else if self.answered < self.answer.len() {
            0
        } else {
            self.due_ns
        }
    }

    /// Its state, if that is due at `now_ns`, with a code of its own.
    pub fn status(&mut self, now_ns: u64, code: u32) -> Option<Frame> {
        if now_ns < self.due_ns || self.id == 0 {
            return None;
        }
        self.due_ns = now_ns.saturating_add(STATUS_EVERY_NS);
        let born_ns = *self.born_ns.get_or_insert(now_ns);
        let mut payload = [0; STATUS_BYTES];
        let uptime_s = now_ns.saturating_sub(born_ns) / NANOSECONDS_PER_SECOND;
        self.common.uptime.write(&mut payload, uptime_s as f64);
        self.common.code.write(&mut payload, f64::from(code));
        if let Some(place) = self.info.get_mut(..STATUS_BYTES) {
            place.copy_from_slice(&payload);
        }
        let header = TransferHeader::message(priority::LOW, self.common.status.type_id, self.id);
        TransferFrames::new(header, self.common.status.seed, self.status_id.take(), &payload).next()
    }

    /// Somebody asks what it is. The last one who asks is answered.
    pub fn ask(&mut self, who: u8, transfer_id: u8) {
        let kind = TransferKind::Response { to: who };
        let type_id = self.common.info_id;
        let header =
            TransferHeader { priority: priority::LOW, type_id, source: self.id, kind, discriminator: 0 };
        self.answer.clear();
        // Room was made for exactly these.
        self.answer.extend(TransferFrames::new(header, self.seed, transfer_id, &self.info));
        self.answered = 0;
    }

    /// Answers who asked for something else, in [`MOST_ANSWER`] bytes at most; in the place of an answer that is still under
    /// way, whose receiver asks again.
    pub fn respond(&mut self, service: &Service, who: u8, transfer_id: u8, payload: &[u8]) {
        let payload = payload.get(..MOST_ANSWER).unwrap_or(payload);
        self.answer.clear();
        self.answer.extend(TransferFrames::new(
            service.response(self.id, who),
            service.seed(),
            transfer_id,
            payload,
        ));
        self.answered = 0;
    }

    /// The next frame of an answer.
    pub fn answer(&mut self) -> Option<Frame> {
        let frame = self.answer.get(self.answered).copied();
        self.answered += usize::from(frame.is_some());
        frame
    }
}
