//! One CAN frame, classic or FD, apart from any socket.

use std::fmt;

/// Bytes of payload the longest (FD) frame carries.
pub const MAXIMUM_LENGTH: usize = 64;

/// A payload buffer: bytes beyond the frame's length are zero.
pub type Payload = [u8; MAXIMUM_LENGTH];

/// Identifier: base (11-bit) or extended (29-bit). The lower one wins the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Id {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

impl Id {
    /// The identifier `number` of the given width; `None` when it does not fit.
    #[must_use]
    pub fn new(number: u32, extended: bool) -> Option<Self> {
        match u16::try_from(number) {
            Ok(short) if !extended => (short <= 0x7FF).then_some(Self::Standard(short)),
            _ => (extended && number <= 0x1FFF_FFFF).then_some(Self::Extended(number)),
        }
    }

    /// The bits of the identifier, without any flag.
    #[must_use]
    pub fn number(self) -> u32 {
        match self {
            Self::Standard(short) => u32::from(short),
            Self::Extended(long) => long,
        }
    }

    /// Whether it has 29 bits.
    #[must_use]
    pub fn is_extended(self) -> bool {
        matches!(self, Self::Extended(_))
    }
}

/// As candump writes it: three digits for 11 bits, eight for 29.
impl fmt::Display for Id {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Standard(short) => write!(formatter, "{short:03X}"),
            Self::Extended(long) => write!(formatter, "{long:08X}"),
        }
    }
}

/// What kind of frame it is on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameKind {
    /// CAN 2.0 data, up to 8 bytes.
    Classic,
    /// CAN 2.0 remote request: a length, no data.
    Remote,
    /// CAN FD data, up to 64 bytes.
    Fd {
        /// The data phase ran at the data bit rate.
        bit_rate_switch: bool,
        /// The sender is error passive.
        error_state: bool,
    },
}

/// A frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    id: Id,
    kind: FrameKind,
    length: u8,
    data: Payload,
}

impl Frame {
    /// A frame of `data`; `None` when the kind of frame cannot have that length.
    #[must_use]
    pub fn new(id: Id, kind: FrameKind, data: &[u8]) -> Option<Self> {
        let fits = match kind {
            FrameKind::Classic => data.len() <= 8,
            FrameKind::Remote => data.is_empty(),
            FrameKind::Fd { .. } => is_fd_length(data.len()),
        };
        if !fits {
            return None;
        }
        let mut payload = [0; MAXIMUM_LENGTH];
        payload.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { id, kind, length: data.len() as u8, data: payload })
    }

    /// An empty classic frame with identifier 0, to be written over.
    pub(super) const EMPTY: Self = Self::zeros(Id::Standard(0), FrameKind::Classic, 0);

    /// A frame of `length` zero bytes, which the caller knows its kind can have.
    pub(super) const fn zeros(id: Id, kind: FrameKind, length: usize) -> Self {
        Self { id, kind, length: length as u8, data: [0; MAXIMUM_LENGTH] }
    }

    /// A classic frame of up to 8 bytes; `None` when `data` is longer.
    #[must_use]
    pub fn classic(id: Id, data: &[u8]) -> Option<Self> {
        Self::new(id, FrameKind::Classic, data)
    }

    /// A remote request for `length` bytes; `None` over 8.
    #[must_use]
    pub fn remote(id: Id, length: u8) -> Option<Self> {
        (length <= 8).then_some(Self { id, kind: FrameKind::Remote, length, data: [0; MAXIMUM_LENGTH] })
    }

    /// Its identifier.
    #[must_use]
    pub fn id(&self) -> Id {
        self.id
    }

    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> FrameKind {
        self.kind
    }

    /// Bytes of payload; what is asked for, in a remote request.
    #[must_use]
    pub fn length(&self) -> usize {
        usize::from(self.length)
    }

    /// The payload; empty for a remote request.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        match self.kind {
            FrameKind::Remote => &[],
            FrameKind::Classic | FrameKind::Fd { .. } => self.data.get(..self.length()).unwrap_or(&[]),
        }
    }

    /// The payload padded with zeros, which the codec reads.
    #[must_use]
    pub fn payload(&self) -> &Payload {
        &self.data
    }

    /// The payload to encode into. Bytes beyond [`Self::length`] are not sent.
    pub(super) fn payload_mut(&mut self) -> &mut Payload {
        &mut self.data
    }
}

/// Whether an FD frame can have this many bytes: 0 to 8, then in steps.
#[must_use]
pub fn is_fd_length(length: usize) -> bool {
    length <= 8 || matches!(length, 12 | 16 | 20 | 24 | 32 | 48 | 64)
}

/// The least length that an FD frame can have from `length` bytes on; 64 at most.
#[must_use]
pub fn fd_length(length: usize) -> usize {
    (length..MAXIMUM_LENGTH).find(|it| is_fd_length(*it)).unwrap_or(MAXIMUM_LENGTH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_and_lengths_that_cannot_be_are_refused() {
        assert_eq!(Id::new(0x7FF, false), Some(Id::Standard(0x7FF)));
        assert_eq!(Id::new(0x800, false), None);
        assert_eq!(Id::new(0x1_0000, false), None);
        assert_eq!(Id::new(0x12, true), Some(Id::Extended(0x12)));
        assert_eq!(Id::new(0x2000_0000, true), None);
        let id = Id::Standard(1);
        assert!(Frame::classic(id, &[0; 9]).is_none());
        let fd = FrameKind::Fd { bit_rate_switch: true, error_state: false };
        assert!(Frame::new(id, fd, &[0; 9]).is_none());
        assert_eq!(Frame::new(id, fd, &[7; 12]).map(|frame| frame.data().len()), Some(12));
        let remote = Frame::remote(id, 8).expect("fits");
        assert_eq!((remote.length(), remote.data().len()), (8, 0));
    }

    /// As `candump` and `cansend` have them.
    #[test]
    fn an_identifier_shows_its_width() {
        assert_eq!(
            (Id::Standard(0x20).to_string(), Id::Extended(0x9_17).to_string()),
            ("020".into(), "00000917".into())
        );
    }
}
