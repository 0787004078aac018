//! Where a signal's bits are and how they are read, as a DBC file writes it.

/// Order of the bytes of a signal, as DBC's `@1` and `@0` say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// Intel, `@1`: `start` is the least significant bit.
    Little,
    /// Motorola, `@0`: `start` is the most significant bit.
    Big,
}

/// How the bits of a signal are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberFormat {
    /// Unsigned integer.
    Unsigned,
    /// Two's complement.
    Signed,
    /// IEEE 754 binary32, `SIG_VALTYPE_ 1`.
    Float32,
    /// IEEE 754 binary64, `SIG_VALTYPE_ 2`.
    Float64,
}

/// The place of a signal as a DBC file writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignalLayout {
    /// DBC start bit.
    pub start: u16,
    /// Number of bits, 1 to 64.
    pub size: u16,
    /// Order of its bytes.
    pub order: ByteOrder,
    /// How its bits are read.
    pub number: NumberFormat,
}

/// Why a layout cannot be compiled.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// No or too many bits.
    #[error("has {0} bits, and a signal has 1 to 64")]
    Size(u64),
    /// Some bit is outside the message.
    #[error("reaches outside the {0} bytes of its message")]
    Outside(u64),
    /// A float with a size no float has.
    #[error("is a {expected}-bit float of {found} bits")]
    Float {
        /// Bits the type has.
        expected: u16,
        /// Bits the signal has.
        found: u16,
    },
    /// A factor of zero, or a factor or offset that is not finite.
    #[error("has the factor {0} and the offset {1}, and cannot carry a value")]
    Scaling(f64, f64),
}

/// Position of the signal's first bit, counted in the order of its bytes: for little-endian from bit 0 of
/// byte 0 upwards, for big-endian from bit 7 of byte 0 downwards.
pub(super) fn network_position(layout: SignalLayout) -> usize {
    let start = usize::from(layout.start);
    match layout.order {
        ByteOrder::Little => start,
        ByteOrder::Big => start - start % 8 + (7 - start % 8),
    }
}
