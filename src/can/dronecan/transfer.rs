//! Transfers: what an identifier and the last byte of a frame say, and the frames that carry a payload.
//!
//! DroneCAN v0 specification, "CAN bus transport layer".

use crate::can::frame::{Frame, FrameKind, Id};

use super::crc;

/// Bytes of a frame beside its tail byte.
pub const FRAME_BYTES: usize = 7;
/// Highest node id; 0 is nobody's.
pub const GREATEST_NODE: u8 = 127;

/// Priorities, as far as they are used here; the lower number wins the bus.
pub mod priority {
    /// What moves rotors.
    pub const HIGH: u8 = 8;
    /// What says whether they may.
    pub const MEDIUM: u8 = 16;
    /// Everything else.
    pub const LOW: u8 = 24;
}

/// What a transfer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TransferKind {
    /// A message, to everybody.
    Message,
    /// A request to the node.
    Request {
        /// Who is asked.
        to: u8,
    },
    /// A response to the node.
    Response {
        /// Who had asked.
        to: u8,
    },
}

/// What the identifier of a frame says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TransferHeader {
    /// 0 to 31.
    pub priority: u8,
    /// Data type id; of a message by nobody its two lowest bits.
    pub type_id: u16,
    /// Node that sends; 0 = a node without an id.
    pub source: u8,
    /// What it is.
    pub kind: TransferKind,
    /// Random bits of a message by nobody, which keep two such nodes apart.
    pub discriminator: u16,
}

impl TransferHeader {
    /// Of a message of this node.
    #[must_use]
    pub fn message(priority: u8, type_id: u16, source: u8) -> Self {
        Self { priority, type_id, source, kind: TransferKind::Message, discriminator: 0 }
    }

    /// What an identifier of 29 bits says.
    #[must_use]
    #[inline]
    pub fn parse(id: u32) -> Self {
        let (priority, source) = ((id >> 24 & 0x1F) as u8, (id & 0x7F) as u8);
        let to = (id >> 8 & 0x7F) as u8;
        let (kind, type_id, discriminator) = match (id & 0x80 != 0, source) {
            (true, _) if id & 0x8000 != 0 => (TransferKind::Request { to }, id >> 16 & 0xFF, 0),
            (true, _) => (TransferKind::Response { to }, id >> 16 & 0xFF, 0),
            (false, 0) => (TransferKind::Message, id >> 8 & 3, id >> 10 & 0x3FFF),
            (false, _) => (TransferKind::Message, id >> 8 & 0xFFFF, 0),
        };
        Self { priority, type_id: type_id as u16, source, kind, discriminator: discriminator as u16 }
    }

    /// The identifier of 29 bits.
    #[must_use]
    #[inline]
    pub fn id(&self) -> u32 {
        let type_id = u32::from(self.type_id);
        let rest = match self.kind {
            TransferKind::Message if self.source == 0 => {
                u32::from(self.discriminator & 0x3FFF) << 10 | (type_id & 3) << 8
            }
            TransferKind::Message => type_id << 8,
            TransferKind::Request { to } => (type_id & 0xFF) << 16 | 0x8080 | u32::from(to & 0x7F) << 8,
            TransferKind::Response { to } => (type_id & 0xFF) << 16 | 0x80 | u32::from(to & 0x7F) << 8,
        };
        u32::from(self.priority & 0x1F) << 24 | rest | u32::from(self.source & 0x7F)
    }
}

/// The last byte of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tail {
    /// The transfer begins with this frame.
    pub start: bool,
    /// It ends with this one.
    pub end: bool,
    /// Turns with each frame of a transfer, from false.
    pub toggle: bool,
    /// Counts the transfers of one type to one receiver, 0 to 31.
    pub transfer_id: u8,
}

impl Tail {
    /// What the byte says.
    #[must_use]
    #[inline]
    pub fn parse(byte: u8) -> Self {
        let bit = |bit: u8| byte & bit != 0;
        Self { start: bit(0x80), end: bit(0x40), toggle: bit(0x20), transfer_id: byte & 0x1F }
    }

    /// The byte.
    #[must_use]
    #[inline]
    pub fn byte(self) -> u8 {
        let bit = |is: bool, bit: u8| if is { bit } else { 0 };
        bit(self.start, 0x80) | bit(self.end, 0x40) | bit(self.toggle, 0x20) | self.transfer_id & 0x1F
    }
}

/// Counts the transfers that leave.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TransferId(u8);

impl TransferId {
    /// The number of the next one, which it is from now on.
    pub fn take(&mut self) -> u8 {
        let next = self.0;
        self.0 = (self.0 + 1) & 0x1F;
        next
    }
}

/// The frames of a transfer, one after the other; `seed` is that of the type, [`super::Subscription::seed`].
#[derive(Debug, Clone)]
pub struct TransferFrames<'a> {
    id: Id,
    seed: u16,
    transfer_id: u8,
    payload: &'a [u8],
    /// Bytes sent, the checksum's two included where there is one.
    sent: usize,
    toggle: bool,
    is_over: bool,
}

impl<'a> TransferFrames<'a> {
    /// The frames that carry `payload`.
    #[must_use]
    pub fn new(header: TransferHeader, seed: u16, transfer_id: u8, payload: &'a [u8]) -> Self {
        let id = Id::Extended(header.id());
        Self { id, seed, transfer_id, payload, sent: 0, toggle: false, is_over: false }
    }

    /// How many frames carry so many bytes.
    #[must_use]
    pub fn count(bytes: usize) -> usize {
        if bytes <= FRAME_BYTES { 1 } else { (bytes + 2).div_ceil(FRAME_BYTES) }
    }

    /// Byte `index` of what is sent.
    fn byte(&self, index: usize, crc: [u8; 2], is_long: bool) -> Option<u8> {
        let behind = if is_long { 2 } else { 0 };
        match index.checked_sub(behind) {
            Some(index) => self.payload.get(index).copied(),
            None => crc.get(index).copied(),
        }
    }
}

impl Iterator for TransferFrames<'_> {
    type Item = Frame;

    fn next(&mut self) -> Option<Frame> {
        if self.is_over {
            return None;
        }
        let is_long = self.payload.len() > FRAME_BYTES;
        let total = self.payload.len() + if is_long { 2 } else { 0 };
        let length = (total - self.sent).min(FRAME_BYTES);
        let crc = if is_long && self.sent == 0 { crc::transfer_crc(self.seed, self.payload) } else { 0 };
        let mut frame = Frame::zeros(self.id, FrameKind::Classic, length + 1);
        let start = self.sent == 0;
        for index in 0..length {
            let byte = self.byte(self.sent + index, crc.to_le_bytes(), is_long).unwrap_or(0);
            if let Some(place) = frame.payload_mut().get_mut(index) {
                *place = byte;
            }
        }
        self.sent += length;
        self.is_over = self.sent == total;
        let tail = Tail { start, end: self.is_over, toggle: self.toggle, transfer_id: self.transfer_id };
        self.toggle = !self.toggle;
        if let Some(place) = frame.payload_mut().get_mut(length) {
            *place = tail.byte();
        }
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_identifier_of_a_node_is_read_and_written_again() {
        for id in (0..0x2000_0000_u32).step_by(0x3_17F1) {
            assert_eq!(TransferHeader::parse(id).id(), id, "{id:#010x}");
        }
        for byte in 0..=u8::MAX {
            assert_eq!(Tail::parse(byte).byte(), byte);
        }
    }

    #[test]
    fn seven_bytes_are_one_frame_and_eight_are_two_with_a_checksum() {
        let header = TransferHeader::message(priority::LOW, 341, 9);
        let frames = |bytes: &[u8]| TransferFrames::new(header, 0xFFFF, 30, bytes).collect::<Vec<_>>();
        let [only] = &frames(&[7; 7])[..] else { panic!("one frame") };
        assert_eq!((only.id(), only.data()[7]), (Id::Extended(0x1801_5509), 0xC0 | 30));
        let both = frames(&[7; 8]);
        let tails: Vec<u8> = both.iter().map(|frame| frame.data()[frame.length() - 1]).collect();
        assert_eq!(tails, [0x80 | 30, 0x60 | 30]);
        let crc = crc::transfer_crc(0xFFFF, &[7; 8]).to_le_bytes();
        assert_eq!((&both[0].data()[..2], both[1].length()), (&crc[..], 4));
        assert_eq!(frames(&[]).len(), 1);
        for bytes in 0..40 {
            assert_eq!(frames(&vec![1; bytes]).len(), TransferFrames::count(bytes), "{bytes}");
        }
    }

    #[test]
    fn thirty_two_transfers_have_numbers_of_their_own() {
        let mut id = TransferId::default();
        let numbers: Vec<u8> = (0..34).map(|_| id.take()).collect();
        assert_eq!((numbers[31], numbers[32], numbers[33]), (31, 0, 1));
    }
}
