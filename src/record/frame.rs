//! A raw frame as the recorder keeps it.

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
