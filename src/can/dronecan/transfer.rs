//! Transfers: what an identifier and the last byte of a frame say, and the frames that carry a payload.
//!
//! DroneCAN specification, "CAN bus transport layer" and "CANFD bus transport layer".

use crate::can::frame::{Frame, FrameKind, Id, MAXIMUM_LENGTH, fd_length};

use super::crc;

/// Bytes of a classical frame beside its tail byte.
pub const FRAME_BYTES: usize = 7;
/// The same of an FD frame.
pub(super) const FD_FRAME_BYTES: usize = MAXIMUM_LENGTH - 1;
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

/// The frames in which a transfer travels, which say how its message is written, too: in FD frames an array has its count
/// at the end of the message as everywhere, and zeros may follow, as FD frames cannot have every length.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Framing {
    /// CAN 2.0.
    #[default]
    Classic,
    /// CAN FD.
    Fd,
}

impl Framing {
    /// That of a bus on which FD frames are sent, or not.
    #[must_use]
    pub fn of_bus(fd: bool) -> Self {
        if fd { Self::Fd } else { Self::Classic }
    }

    /// That of a transfer with this frame.
    #[must_use]
    #[inline]
    pub fn of(frame: &Frame) -> Self {
        Self::of_bus(matches!(frame.kind(), FrameKind::Fd { .. }))
    }

    /// [byte] that a frame has beside its tail byte.
    #[must_use]
    #[inline]
    pub fn frame_bytes(self) -> usize {
        match self {
            Self::Classic => FRAME_BYTES,
            Self::Fd => FD_FRAME_BYTES,
        }
    }

    fn kind(self) -> FrameKind {
        match self {
            Self::Classic => FrameKind::Classic,
            Self::Fd => FrameKind::Fd { bit_rate_switch: true, error_state: false },
        }
    }

    /// [byte] of zeros behind so many, the checksum's two included, so that the last frame has a length that there is.
    #[must_use]
    pub(super) fn padding(self, bytes: usize) -> usize {
        let last = match bytes % FD_FRAME_BYTES {
            0 if bytes > 0 => FD_FRAME_BYTES,
            rest => rest,
        };
        match self {
            Self::Classic => 0,
            Self::Fd => fd_length(last + 1) - (last + 1),
        }
    }

    /// [byte] of all frames together that carry a payload of so many, their tail bytes aside.
    #[must_use]
    pub(super) fn sent_bytes(self, payload: usize) -> usize {
        let bytes = if payload > self.frame_bytes() { payload + 2 } else { payload };
        bytes + self.padding(bytes)
    }
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
    framing: Framing,
    seed: u16,
    transfer_id: u8,
    payload: &'a [u8],
    /// Bytes sent, the checksum's two and the zeros at the end included where there are some.
    sent: usize,
    toggle: bool,
    is_over: bool,
}

impl<'a> TransferFrames<'a> {
    /// The classical frames that carry `payload`.
    #[must_use]
    pub fn new(header: TransferHeader, seed: u16, transfer_id: u8, payload: &'a [u8]) -> Self {
        let (id, framing) = (Id::Extended(header.id()), Framing::Classic);
        Self { id, framing, seed, transfer_id, payload, sent: 0, toggle: false, is_over: false }
    }

    /// The same payload in such frames, for which it was written.
    #[must_use]
    pub fn framed(self, framing: Framing) -> Self {
        Self { framing, ..self }
    }

    /// How many such frames carry so many bytes.
    #[must_use]
    pub fn count(bytes: usize, framing: Framing) -> usize {
        framing.sent_bytes(bytes).div_ceil(framing.frame_bytes()).max(1)
    }

    /// The checksum of what is sent: of the zeros at its end, too.
    fn crc(&self, total: usize) -> u16 {
        let crc = crc::transfer_crc(self.seed, self.payload);
        let zeros = [0; FD_FRAME_BYTES];
        crc::transfer_crc(crc, zeros.get(..total - self.payload.len() - 2).unwrap_or(&[]))
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
        let is_long = self.payload.len() > self.framing.frame_bytes();
        let total = self.framing.sent_bytes(self.payload.len());
        let length = (total - self.sent).min(self.framing.frame_bytes());
        let crc = if is_long && self.sent == 0 { self.crc(total) } else { 0 };
        let mut frame = Frame::zeros(self.id, self.framing.kind(), length + 1);
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
            assert_eq!(
                frames(&vec![1; bytes]).len(),
                TransferFrames::count(bytes, Framing::Classic),
                "{bytes}"
            );
        }
    }

    /// Lengths as libcanard has them (`canard.c`, `enqueueTxFrames`): each last frame as long as the next that there is, its tail
    /// byte the last one. Where 62 bytes stand in a frame, pydronecan leaves it at 63, which no controller sends.
    #[test]
    fn fd_frames_have_lengths_that_there_are_and_a_checksum_of_their_zeros_too() {
        let header = TransferHeader::message(priority::LOW, 341, 9);
        for bytes in 0..400 {
            let payload = vec![0xA5; bytes];
            let frames: Vec<Frame> =
                TransferFrames::new(header, 0xFFFF, 3, &payload).framed(Framing::Fd).collect();
            assert_eq!(frames.len(), TransferFrames::count(bytes, Framing::Fd), "{bytes}");
            assert_eq!(frames.len(), if bytes < 64 { 1 } else { (bytes + 2).div_ceil(63) }, "{bytes}");
            let (last, before) = frames.split_last().expect("one at least");
            assert!(before.iter().all(|frame| frame.length() == 64), "{bytes}");
            assert!(crate::can::frame::is_fd_length(last.length()), "{bytes}: {}", last.length());
            assert!(frames.iter().all(|frame| Framing::of(frame) == Framing::Fd));
            let all: Vec<u8> = frames
                .iter()
                .flat_map(|frame| frame.data().split_last().expect("a tail").1)
                .copied()
                .collect();
            let (crc, sent) = all.split_at(if bytes < 64 { 0 } else { 2 });
            assert_eq!(&sent[..bytes], payload, "{bytes}");
            assert!(sent.len() - bytes < 16 && sent[bytes..].iter().all(|byte| *byte == 0), "{bytes}");
            assert!(bytes < 64 || crc == crc::transfer_crc(0xFFFF, sent).to_le_bytes(), "{bytes}");
        }
        for (bytes, lengths) in
            [(7, [8].as_slice()), (8, &[12]), (62, &[64]), (63, &[64]), (64, &[64, 4]), (123, &[64, 64])]
        {
            let payload = vec![1; bytes];
            let frames = TransferFrames::new(header, 0xFFFF, 3, &payload).framed(Framing::Fd);
            assert_eq!(frames.map(|frame| frame.length()).collect::<Vec<_>>(), lengths, "{bytes}");
        }
    }

    /// The frames that libcanard (commit 601ed35, `CANARD_ENABLE_CANFD`) makes of payloads of 1 to 400 bytes, 1,487 of them: their
    /// lengths and bytes, one behind the other, as one checksum. pydronecan makes the same, the lengths above aside.
    #[test]
    fn fd_frames_are_those_of_libcanard() {
        let header = TransferHeader::message(priority::LOW, 341, 9);
        let seed = crc::transfer_seed(0x0F08_68D0_C1A7_C6F1);
        let payload: Vec<u8> = (0..400_u32).map(|at| (7 * at + 3) as u8).collect();
        let (mut checksum, mut count) = (0, 0);
        for bytes in 1..=payload.len() {
            for frame in TransferFrames::new(header, seed, 3, &payload[..bytes]).framed(Framing::Fd) {
                checksum = crc::signature(checksum, &[frame.length() as u8]);
                checksum = crc::signature(checksum, frame.data());
                count += 1;
            }
        }
        assert_eq!((count, checksum), (1_487, 0x4F4F_F24A_2761_A61C));
    }

    #[test]
    fn thirty_two_transfers_have_numbers_of_their_own() {
        let mut id = TransferId::default();
        let numbers: Vec<u8> = (0..34).map(|_| id.take()).collect();
        assert_eq!((numbers[31], numbers[32], numbers[33]), (31, 0, 1));
    }
}
