//! A raw frame as the recorder keeps it.

use crate::can::{Arrival, ErrorFrame, Frame, FrameKind, Id};

/// One CAN frame, received or sent, with its stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawFrame {
    /// [ns] CLOCK_MONOTONIC at arrival or sending.
    pub stamp_ns: u64,
    /// [ns] the adapter's clock; 0 = none.
    pub hardware_ns: u64,
    /// Identifier, 11 or 29 bits, without flags; the error class of an error frame.
    pub id: u32,
    /// Bits of [`FrameFlags`].
    pub flags: u32,
    /// Bytes of `data` used; of a remote frame, the length it asks for.
    pub length: u8,
    /// Payload, zero behind its length.
    pub data: [u8; 64],
}

/// Bits of [`RawFrame::flags`].
pub struct FrameFlags;

impl FrameFlags {
    /// 29-bit identifier.
    pub const EXTENDED: u32 = 1;
    /// Remote transmission request.
    pub const REMOTE: u32 = 1 << 1;
    /// Error frame of the kernel.
    pub const ERROR: u32 = 1 << 2;
    /// CAN FD frame.
    pub const FD: u32 = 1 << 3;
    /// CAN FD: second bit rate.
    pub const BIT_RATE_SWITCH: u32 = 1 << 4;
    /// CAN FD: the sender was error passive.
    pub const ERROR_STATE: u32 = 1 << 5;
    /// Sent by this machine.
    pub const SENT: u32 = 1 << 6;
}

impl Default for RawFrame {
    fn default() -> Self {
        Self { stamp_ns: 0, hardware_ns: 0, id: 0, flags: 0, length: 0, data: [0; 64] }
    }
}

impl RawFrame {
    /// The payload.
    #[must_use]
    pub fn payload(&self) -> &[u8] {
        self.data.get(..usize::from(self.length)).unwrap_or(&self.data)
    }

    /// Whether the bit of [`FrameFlags`] is set.
    #[must_use]
    pub fn is(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }
}

impl RawFrame {
    /// A data or remote frame; `sent` by this machine, or received.
    #[must_use]
    pub fn new(frame: &Frame, stamp_ns: u64, hardware_ns: Option<u64>, sent: bool) -> Self {
        let flag = |set: bool, flag: u32| if set { flag } else { 0 };
        let kind = match frame.kind() {
            FrameKind::Classic => 0,
            FrameKind::Remote => FrameFlags::REMOTE,
            FrameKind::Fd { bit_rate_switch, error_state } => {
                FrameFlags::FD
                    | flag(bit_rate_switch, FrameFlags::BIT_RATE_SWITCH)
                    | flag(error_state, FrameFlags::ERROR_STATE)
            }
        };
        Self {
            stamp_ns,
            hardware_ns: hardware_ns.unwrap_or(0),
            id: frame.id().number(),
            flags: kind | flag(frame.id().is_extended(), FrameFlags::EXTENDED) | flag(sent, FrameFlags::SENT),
            length: frame.length() as u8,
            data: *frame.payload(),
        }
    }

    /// An error frame of the controller.
    #[must_use]
    pub fn error(error: &ErrorFrame, stamp_ns: u64) -> Self {
        let mut frame =
            Self { stamp_ns, id: error.class, flags: FrameFlags::ERROR, length: 8, ..Self::default() };
        for (to, from) in frame.data.iter_mut().zip(error.data) {
            *to = from;
        }
        frame
    }

    /// What came in through a port.
    #[must_use]
    pub fn arrived(arrival: &Arrival) -> Self {
        match arrival {
            Arrival::Frame { frame, stamp_ns, hardware_ns } => {
                Self::new(frame, *stamp_ns, *hardware_ns, false)
            }
            Arrival::Echo { frame, stamp_ns } => Self::new(frame, *stamp_ns, None, true),
            Arrival::Error { error, stamp_ns } => Self::error(error, *stamp_ns),
        }
    }

    /// The data or remote frame; `None` for an error frame, and for what no bus can carry.
    #[must_use]
    pub fn frame(&self) -> Option<Frame> {
        let id = Id::new(self.id, self.is(FrameFlags::EXTENDED))?;
        if self.is(FrameFlags::ERROR) {
            None
        } else if self.is(FrameFlags::REMOTE) {
            Frame::remote(id, self.length)
        } else if self.is(FrameFlags::FD) {
            let bit_rate_switch = self.is(FrameFlags::BIT_RATE_SWITCH);
            let error_state = self.is(FrameFlags::ERROR_STATE);
            Frame::new(id, FrameKind::Fd { bit_rate_switch, error_state }, self.payload())
        } else {
            Frame::classic(id, self.payload())
        }
    }
}
