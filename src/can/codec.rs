//! A signal compiled once: where its bits lie in a 64-bit word, how they become a number, and back.
//!
//! A signal that lies within eight neighbouring bytes of the payload is one load, one shift and one mask. The
//! few that do not (more than 57 bits across nine bytes, possible in CAN FD) are walked bit by bit, as
//! [`super::walk`] does for any signal; the walk is also what the tests compare this file with.
//!
//! Where it can be, the eight bytes are those of an aligned word: signals written one after the other then read what
//! was just stored as it was stored, which a processor forwards, and not across two stores, for which it waits.

use super::frame::{MAXIMUM_LENGTH, Payload};
use super::layout::{ByteOrder, LayoutError, NumberFormat, SignalLayout, network_position};
use super::walk;

#[cfg(test)]
mod tests;

/// A compiled signal: `value = raw * factor + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalCodec {
    layout: SignalLayout,
    /// First byte of the eight that hold the signal; `None`: it is walked.
    window: Option<u8>,
    /// They are the payload's first.
    is_in_first_word: bool,
    shift: u8,
    /// The signal's bits, at the bottom of the word.
    mask: u64,
    factor: f64,
    offset: f64,
    /// The factor is 1 and the offset 0: nothing to divide by, which is what encoding takes longest for.
    is_unit: bool,
    conversion: Conversion,
}

/// How the bits become a number, and back.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Conversion {
    /// An integer that is rounded by adding [`ROUNDING`].
    Short {
        /// The sign bit; 0 when unsigned.
        sign: u64,
        /// Least and greatest integer.
        range: (f64, f64),
        /// The bits for a value that is not a number.
        at_nan: u64,
    },
    /// Any other integer; with factor and offset where both are integers and the product can leave the 53 bits in
    /// which `f64` is exact.
    Long(Option<(i64, i64)>),
    /// IEEE 754 binary32.
    Float32,
    /// IEEE 754 binary64.
    Float64,
}

/// 1.5 · 2^52. Between 2^52 and 2^53 the doubles are the integers: adding this to a number of up to 51 bits rounds it
/// to the nearest one, to the even one of two, and leaves it in the lowest bits in two's complement.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// Greatest number of bits that may be rounded so.
const SHORT: u16 = 51;

impl SignalCodec {
    /// Compiles a signal of a message of `length` bytes.
    ///
    /// # Errors
    /// [`LayoutError`] when the signal does not fit the message or cannot carry a value.
    pub fn build(layout: SignalLayout, length: usize, factor: f64, offset: f64) -> Result<Self, LayoutError> {
        let size = layout.size;
        if !(1..=64).contains(&size) {
            return Err(LayoutError::Size(u64::from(size)));
        }
        let expected = match layout.number {
            NumberFormat::Float32 => 32,
            NumberFormat::Float64 => 64,
            NumberFormat::Unsigned | NumberFormat::Signed => size,
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
        // The eight bytes that are read may begin before the signal: at an aligned word. One that crosses it ends before the last.
        let aligned = first / 64 * 8;
        let byte = if last < 8 * (aligned + 8) { aligned } else { first / 8 };
        let fits = last < 8 * (byte + 8);
        let shift = match layout.order {
            ByteOrder::Little => first.saturating_sub(8 * byte),
            ByteOrder::Big => (8 * (byte + 8)).saturating_sub(last + 1),
        };
        let mut codec = Self {
            layout,
            window: fits.then_some(byte as u8),
            is_in_first_word: fits && byte == 0,
            shift: shift as u8,
            mask: u64::MAX >> (64 - size),
            factor,
            offset,
            is_unit: factor == 1.0 && offset == 0.0,
            conversion: Conversion::Long(None),
        };
        codec.conversion = codec.shortest_conversion();
        Ok(codec)
    }

    /// The quickest conversion that gives what the general one gives, which this codec still has.
    fn shortest_conversion(&self) -> Conversion {
        let Self { layout, mask, factor, offset, .. } = self;
        let sign = match layout.number {
            NumberFormat::Float32 => return Conversion::Float32,
            NumberFormat::Float64 => return Conversion::Float64,
            NumberFormat::Unsigned => 0,
            NumberFormat::Signed => mask ^ (mask >> 1),
        };
        let whole =
            factor.fract() == 0.0 && offset.fract() == 0.0 && factor.abs() < 9e18 && offset.abs() < 9e18;
        let exact = (*mask as f64) * factor.abs() + offset.abs() <= 9_007_199_254_740_992.0;
        if whole && !exact {
            return Conversion::Long(Some((*factor as i64, *offset as i64)));
        }
        if layout.size > SHORT {
            return Conversion::Long(None);
        }
        let range = (-(sign as f64), (mask ^ sign) as f64);
        Conversion::Short { sign, range, at_nan: self.unscale(0.0) }
    }

    /// Where the signal lies.
    #[must_use]
    pub fn layout(&self) -> SignalLayout {
        self.layout
    }

    /// Bytes that a payload must have to hold all its bits.
    pub(super) fn least_length(&self) -> usize {
        (network_position(self.layout) + usize::from(self.layout.size)).div_ceil(8)
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

    /// Whether the signal lies in the payload's first eight bytes.
    pub(super) fn is_in_first_word(&self) -> bool {
        self.is_in_first_word
    }

    /// The low bits of `raw` where the signal has them in the payload's first eight bytes, read as a little-endian
    /// word; for a signal that lies there.
    #[inline]
    pub(super) fn in_first_word(&self, raw: u64) -> u64 {
        self.placed(raw & self.mask)
    }

    /// The bits nearest to `value`, as [`Self::in_first_word`].
    #[inline]
    pub(super) fn encode_in_first_word(&self, value: f64) -> u64 {
        self.placed(self.unscale(value))
    }

    #[inline]
    fn placed(&self, masked: u64) -> u64 {
        let word = masked << self.shift;
        match self.layout.order {
            ByteOrder::Little => word,
            ByteOrder::Big => word.swap_bytes(),
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
        let number = match self.conversion {
            Conversion::Short { sign, .. } => (raw ^ sign).wrapping_sub(sign) as i64 as f64,
            Conversion::Long(Some((factor, offset))) => {
                // Rounded once, at the end: what arithmetic on integers gives, and cantools with it.
                return (self.integer(raw) * i128::from(factor) + i128::from(offset)) as f64;
            }
            Conversion::Long(None) if self.layout.number == NumberFormat::Signed => self.extend(raw) as f64,
            Conversion::Long(None) => raw as f64,
            Conversion::Float32 => f64::from(f32::from_bits(raw as u32)),
            Conversion::Float64 => f64::from_bits(raw),
        };
        number * self.factor + self.offset
    }

    /// The bits nearest to `value`; at the end of the signal's range where that does not reach. A value that is
    /// not a number gives the bits of 0 (of zero command, for an actuator) in an integer signal.
    #[must_use]
    #[inline]
    pub fn unscale(&self, value: f64) -> u64 {
        let number = if self.is_unit { value } else { (value - self.offset) / self.factor };
        if let Conversion::Short { range: (least, greatest), at_nan, .. } = self.conversion {
            if number.is_nan() {
                return at_nan;
            }
            let above = if number > least { number } else { least };
            let within = if above < greatest { above } else { greatest };
            return (within + ROUNDING).to_bits() & self.mask;
        }
        if matches!(self.conversion, Conversion::Float32) {
            return u64::from((number as f32).to_bits());
        }
        self.nearest(number)
    }

    /// The bits nearest to `number`, for an integer of any size and for binary64.
    // Apart, so that the few do not lengthen what is done for the many.
    #[inline(never)]
    fn nearest(&self, number: f64) -> u64 {
        if matches!(self.conversion, Conversion::Float64) {
            return number.to_bits();
        }
        if number.is_nan() {
            return self.unscale(0.0);
        }
        if self.layout.number == NumberFormat::Unsigned {
            return (number.round_ties_even() as u64).min(self.mask);
        }
        let greatest = (self.mask >> 1) as i64;
        (number.round_ties_even() as i64).clamp(-greatest - 1, greatest) as u64 & self.mask
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
            NumberFormat::Unsigned => (0, self.mask),
            NumberFormat::Signed => ((self.mask >> 1) + 1, self.mask >> 1),
            NumberFormat::Float32 => (u64::from(f32::MIN.to_bits()), u64::from(f32::MAX.to_bits())),
            NumberFormat::Float64 => (f64::MIN.to_bits(), f64::MAX.to_bits()),
        };
        let (one, other) = (self.scale(least), self.scale(greatest));
        (one.min(other), one.max(other))
    }

    /// The integer that `raw` stands for.
    fn integer(&self, raw: u64) -> i128 {
        match self.layout.number {
            NumberFormat::Signed => i128::from(self.extend(raw)),
            _ => i128::from(raw),
        }
    }

    fn extend(&self, raw: u64) -> i64 {
        let unused = 64 - u32::from(self.layout.size);
        ((raw << unused) as i64) >> unused
    }
}

/// The window's first byte as an index whose eight bytes the compiler knows to be there.
#[inline]
fn within(byte: u8) -> usize {
    usize::from(byte).min(MAXIMUM_LENGTH - 8)
}

#[inline]
fn load(payload: &Payload, byte: u8, order: ByteOrder) -> u64 {
    let mut word = [0; 8];
    if let Some(window) = payload.get(within(byte)..within(byte) + 8) {
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
    if let Some(window) = payload.get_mut(within(byte)..within(byte) + 8) {
        window.copy_from_slice(&word);
    }
}
