//! What every node owes the bus: once a second how it is, and what it is when it is asked.

use crate::can::frame::Frame;
use crate::clock::NANOSECONDS_PER_SECOND;

use super::allocation::{UNIQUE, UniqueId};
use super::assembler::Transfer;
use super::common::Common;
use super::crc;
use super::service::Service;
use super::store::MOST_ANSWER;
use super::transfer::{Framing, TransferFrames, TransferHeader, TransferId, TransferKind, priority};

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
    /// In which frames it says how it is; who asks is answered as it asked.
    framing: Framing,
    common: Common,
    /// [ns] of its first status, and when the next one is due.
    born_ns: Option<u64>,
    due_ns: u64,
    status_id: TransferId,
    seed: u16,
    /// The response to `GetNodeInfo` in classical and in FD frames, and the frames of an answer that are still to be sent.
    info: [Vec<u8>; 2],
    answer: Vec<Frame>,
    answered: usize,
}

impl Node {
    /// The node with this id and `name`, which asks others and is asked for little: its unique id is made of its number.
    pub fn new(common: &Common, id: u8, name: &str) -> Self {
        let mut unique_id = UniqueId([0; UNIQUE]);
        let unique = b"rotorbench".iter().chain(std::iter::once(&id));
        unique_id.0.iter_mut().zip(unique).for_each(|(place, byte)| *place = *byte);
        Self::with_unique_id(common, id, name, unique_id)
    }

    /// The same with this unique id.
    pub fn with_unique_id(common: &Common, id: u8, name: &str, unique_id: UniqueId) -> Self {
        let info = [Framing::Classic, Framing::Fd].map(|framing| common.node_info(name, unique_id, framing));
        let longest = info.iter().map(Vec::len).max().unwrap_or(0).max(MOST_ANSWER);
        let answer = Vec::with_capacity(TransferFrames::count(longest, Framing::Classic));
        let seed = crc::transfer_seed(common.info_signature);
        Self {
            id,
            framing: Framing::Classic,
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

    /// The same node, which says how it is in such frames.
    pub fn framed(self, framing: Framing) -> Self {
        Self { framing, ..self }
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
        self.common.uptime.write(&mut payload, self.framing, uptime_s as f64);
        self.common.code.write(&mut payload, self.framing, f64::from(code));
        for place in self.info.iter_mut().filter_map(|info| info.get_mut(..STATUS_BYTES)) {
            place.copy_from_slice(&payload);
        }
        let header = TransferHeader::message(priority::LOW, self.common.status.type_id, self.id);
        let transfer_id = self.status_id.take();
        TransferFrames::new(header, self.common.status.seed, transfer_id, &payload)
            .framed(self.framing)
            .next()
    }

    /// Somebody asks what it is. The last one who asks is answered, in frames as those of the question.
    pub fn ask(&mut self, question: &Transfer<'_>) {
        let Transfer { header: TransferHeader { source: who, .. }, framing, transfer_id, .. } = *question;
        let kind = TransferKind::Response { to: who };
        let type_id = self.common.info_id;
        let header =
            TransferHeader { priority: priority::LOW, type_id, source: self.id, kind, discriminator: 0 };
        self.answer.clear();
        // Room was made for exactly these.
        let [classic, fd] = &self.info;
        let info = if framing == Framing::Fd { fd } else { classic };
        self.answer.extend(TransferFrames::new(header, self.seed, transfer_id, info).framed(framing));
        self.answered = 0;
    }

    /// Answers who asked for something else, in [`MOST_ANSWER`] bytes at most that are written for the frames of the question; in
    /// the place of an answer that is still under way, whose receiver asks again.
    pub fn respond(&mut self, service: &Service, question: &Transfer<'_>, payload: &[u8]) {
        let payload = payload.get(..MOST_ANSWER).unwrap_or(payload);
        self.answer.clear();
        let header = service.response(self.id, question.header.source);
        let frames = TransferFrames::new(header, service.seed(), question.transfer_id, payload);
        self.answer.extend(frames.framed(question.framing));
        self.answered = 0;
    }

    /// The next frame of an answer.
    pub fn answer(&mut self) -> Option<Frame> {
        let frame = self.answer.get(self.answered).copied();
        self.answered += usize::from(frame.is_some());
        frame
    }
}
