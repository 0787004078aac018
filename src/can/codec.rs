//! A signal compiled once: where its bits lie in a 64-bit word, how they become a number, and back.
//!
//! A signal that lies within eight neighbouring bytes of the payload is one load, one shift and one mask. The
//! few that do not (more than 57 bits across nine bytes, possible in CAN FD) are walked bit by bit, as
//! [`super::walk`] does for any signal; the walk is also what the tests compare this file with.

use super::frame::{MAXIMUM_LENGTH, Payload};
use super::walk;

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
pub enum Number {
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
pub struct Layout {
    /// DBC start bit.
    pub start: u16,
    /// Number of bits, 1 to 64.
    pub size: u16,
    /// Order of its bytes.
    pub order: ByteOrder,
    /// How its bits are read.
    pub number: Number,
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

/// A compiled signal: `value = raw * factor + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalCodec {
    layout: Layout,
    /// First byte of the eight that hold the signal; `None`: it is walked.
    window: Option<u8>,
    shift: u8,
    /// The signal's bits, at the bottom of the word.
    mask: u64,
    factor: f64,
    offset: f64,
    /// Factor and offset, where both are integers and the product can leave the 53 bits in which `f64` is exact.
    wide: Option<(i64, i64)>,
}

impl SignalCodec {
    /// Compiles a signal of a message of `length` bytes.
    ///
    /// # Errors
    /// [`LayoutError`] when the signal does not fit the message or cannot carry a value.
    pub fn build(layout: Layout, length: usize, factor: f64, offset: f64) -> Result<Self, LayoutError> {
        let size = layout.size;
        if !(1..=64).contains(&size) {
            return Err(LayoutError::Size(u64::from(size)));
        }
        let expected = match layout.number {
            Number::Float32 => 32,
            Number::Float64 => 64,
            Number::Unsigned | Number::Signed => size,
        };
        if size != expected {
            return Err(LayoutError::Float { expected, found: size });
        }
        if factor == 0.0 || !factor.is_finite() || !offset.is_finite() {
            return Err(LayoutError::Scaling(factor, offset));
        }
        let first = network_position(layout);
        let last = first + usize::from(size) - 1;
        if length > MAXIMUM_LENGTH || last >= 8 * length {
            return Err(LayoutError::Outside(length as u64));
        }
        // The eight bytes that are read may begin before the signal, where it lies at the payload's end.
        let byte = (first / 8).min(MAXIMUM_LENGTH - 8);
        let fits = last < 8 * (byte + 8);
        let shift = match layout.order {
            ByteOrder::Little => first.saturating_sub(8 * byte),
            ByteOrder::Big => (8 * (byte + 8)).saturating_sub(last + 1),
        };
        let mask = u64::MAX >> (64 - size);
        let whole =
            factor.fract() == 0.0 && offset.fract() == 0.0 && factor.abs() < 9e18 && offset.abs() < 9e18;
        let exact = (mask as f64) * factor.abs() + offset.abs() <= 9_007_199_254_740_992.0;
        let integer = matches!(layout.number, Number::Unsigned | Number::Signed);
        Ok(Self {
            layout,
            window: fits.then_some(byte as u8),
            shift: shift as u8,
            mask,
            factor,
            offset,
            wide: (integer && whole && !exact).then_some((factor as i64, offset as i64)),
        })
    }

    /// Where the signal lies.
    #[must_use]
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Factor of `value = raw * factor + offset`.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Offset of `value = raw * factor + offset`.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// The signal's bits, unextended.
    #[must_use]
    #[inline]
    pub fn decode_raw(&self, payload: &Payload) -> u64 {
        match self.window {
            Some(byte) => (load(payload, byte, self.layout.order) >> self.shift) & self.mask,
            None => walk::decode_raw(self.layout, payload),
        }
    }

    /// Writes the low bits of `raw` into the signal's place and touches no other bit.
    #[inline]
    pub fn encode_raw(&self, payload: &mut Payload, raw: u64) {
        match self.window {
            Some(byte) => {
                let word = load(payload, byte, self.layout.order) & !(self.mask << self.shift);
                store(payload, byte, self.layout.order, word | ((raw & self.mask) << self.shift));
            }
            None => walk::encode_raw(self.layout, payload, raw),
        }
    }

    /// The signal's value, in the unit of the DBC file.
    #[must_use]
    #[inline]
    pub fn decode(&self, payload: &Payload) -> f64 {
        self.scale(self.decode_raw(payload))
    }

    /// The value of the bits `raw`, in the unit of the DBC file.
    #[must_use]
    #[inline]
    pub fn scale(&self, raw: u64) -> f64 {
        if let Some((factor, offset)) = self.wide {
            let raw = match self.layout.number {
                Number::Signed => i128::from(self.extend(raw)),
                _ => i128::from(raw),
            };
            // Rounded once, at the end: what arithmetic on integers gives, and cantools with it.
            return (raw * i128::from(factor) + i128::from(offset)) as f64;
        }
        let number = match self.layout.number {
            Number::Unsigned => raw as f64,
            Number::Signed => self.extend(raw) as f64,
            Number::Float32 => f64::from(f32::from_bits(raw as u32)),
            Number::Float64 => f64::from_bits(raw),
        };
        number * self.factor + self.offset
    }

    /// The bits nearest to `value`; at the end of the signal's range where that does not reach. A value that is
    /// not a number gives the bits of 0 (of zero command, for an actuator) in an integer signal.
    #[must_use]
    #[inline]
    pub fn unscale(&self, value: f64) -> u64 {
        let number = (value - self.offset) / self.factor;
        match self.layout.number {
            Number::Float32 => u64::from((number as f32).to_bits()),
            Number::Float64 => number.to_bits(),
            _ if number.is_nan() => self.unscale(0.0),
            Number::Unsigned => (number.round_ties_even() as u64).min(self.mask),
            Number::Signed => {
                let greatest = (self.mask >> 1) as i64;
                (number.round_ties_even() as i64).clamp(-greatest - 1, greatest) as u64 & self.mask
            }
        }
    }

    /// Writes the bits nearest to `value`; see [`Self::unscale`].
    #[inline]
    pub fn encode(&self, payload: &mut Payload, value: f64) {
        self.encode_raw(payload, self.unscale(value));
    }

    /// Least and greatest value the bits can express.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        let (least, greatest) = match self.layout.number {
            Number::Unsigned => (0, self.mask),
            Number::Signed => ((self.mask >> 1) + 1, self.mask >> 1),
            Number::Float32 => (u64::from(f32::MIN.to_bits()), u64::from(f32::MAX.to_bits())),
            Number::Float64 => (f64::MIN.to_bits(), f64::MAX.to_bits()),
        };
        let (one, other) = (self.scale(least), self.scale(greatest));
        (one.min(other), one.max(other))
    }

    fn extend(&self, raw: u64) -> i64 {
        let unused = 64 - u32::from(self.layout.size);
        ((raw << unused) as i64) >> unused
    }
}

/// Position of the signal's first bit, counted in the order of its bytes: for little-endian from bit 0 of
/// byte 0 upwards, for big-endian from bit 7 of byte 0 downwards.
pub(super) fn network_position(layout: Layout) -> usize {
    let start = usize::from(layout.start);
    match layout.order {
        ByteOrder::Little => start,
        ByteOrder::Big => start - start % 8 + (7 - start % 8),
    }
}

#[inline]
fn load(payload: &Payload, byte: u8, order: ByteOrder) -> u64 {
    let mut word = [0; 8];
    if let Some(window) = payload.get(usize::from(byte)..usize::from(byte) + 8) {
        word.copy_from_slice(window);
    }
    match order {
        ByteOrder::Little => u64::from_le_bytes(word),
        ByteOrder::Big => u64::from_be_bytes(word),
    }
}

#[inline]
fn store(payload: &mut Payload, byte: u8, order: ByteOrder, word: u64) {
    let word = match order {
        ByteOrder::Little => word.to_le_bytes(),
        ByteOrder::Big => word.to_be_bytes(),
    };
    if let Some(window) = payload.get_mut(usize::from(byte)..usize::from(byte) + 8) {
        window.copy_from_slice(&word);
    }
}
