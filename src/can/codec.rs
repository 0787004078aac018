//! A signal compiled once: where its bits lie in a 64-bit word, how they become a number, and back.
//!
//! A signal that lies within eight neighbouring bytes of the payload is one load, one shift and one mask. The
//! few that do not (more than 57 bits across nine bytes, possible in CAN FD) are walked bit by bit, as
//! [`super::walk`] does for any signal; the walk is also what the tests compare this file with.
//!
//! Where it can be, the eight bytes are those of an aligned word: signals written one after the other then read what
//! was just stored as it was stored, which a processor forwards, and not across two stores, for which it waits.

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
            Number::Float32 => return Conversion::Float32,
            Number::Float64 => return Conversion::Float64,
            Number::Unsigned => 0,
            Number::Signed => mask ^ (mask >> 1),
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

    /// Whether the signal lies in the payload's first eight bytes.
    pub(super) fn is_in_first_word(&self) -> bool {
        self.window == Some(0)
    }

    /// The low bits of `raw` where the signal has them in the payload's first eight bytes, read as a little-endian
    /// word; for a signal that lies there.
    #[inline]
    pub(super) fn in_first_word(&self, raw: u64) -> u64 {
        let word = (raw & self.mask) << self.shift;
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
            Conversion::Long(None) if self.layout.number == Number::Signed => self.extend(raw) as f64,
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
        match self.conversion {
            Conversion::Short { at_nan, .. } if number.is_nan() => at_nan,
            Conversion::Short { range: (least, greatest), .. } => {
                let above = if number > least { number } else { least };
                let within = if above < greatest { above } else { greatest };
                (within + ROUNDING).to_bits() & self.mask
            }
            Conversion::Long(_) => self.nearest(number),
            Conversion::Float32 => u64::from((number as f32).to_bits()),
            Conversion::Float64 => number.to_bits(),
        }
    }

    /// The bits nearest to `number`, for an integer of any size.
    fn nearest(&self, number: f64) -> u64 {
        if number.is_nan() {
            return self.unscale(0.0);
        }
        if self.layout.number == Number::Unsigned {
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
            Number::Unsigned => (0, self.mask),
            Number::Signed => ((self.mask >> 1) + 1, self.mask >> 1),
            Number::Float32 => (u64::from(f32::MIN.to_bits()), u64::from(f32::MAX.to_bits())),
            Number::Float64 => (f64::MIN.to_bits(), f64::MAX.to_bits()),
        };
        let (one, other) = (self.scale(least), self.scale(greatest));
        (one.min(other), one.max(other))
    }

    /// The integer that `raw` stands for.
    fn integer(&self, raw: u64) -> i128 {
        match self.layout.number {
            Number::Signed => i128::from(self.extend(raw)),
            _ => i128::from(raw),
        }
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Rounding and limiting as their definitions say, in integers, without the addition that does it at once.
    fn nearest(layout: Layout, number: f64) -> u64 {
        let mask = u64::MAX >> (64 - layout.size);
        let (least, greatest) = match layout.number {
            Number::Signed => (-i128::from(mask >> 1) - 1, i128::from(mask >> 1)),
            _ => (0, i128::from(mask)),
        };
        let below = number.floor();
        let half = number - below;
        let up = half > 0.5 || (half == 0.5 && below.rem_euclid(2.0) == 1.0);
        // A float beyond the integer's ends saturates.
        let integer = below as i128 + i128::from(up);
        integer.clamp(least, greatest) as u64 & mask
    }

    proptest! {
        /// Halves, neighbours of halves, integers, ends of the range and anything else, for all sizes.
        #[test]
        fn rounds_to_the_nearest_and_to_even(
            size in 1_u16..=64,
            signed in any::<bool>(),
            base in prop_oneof![-300_i64..300, any::<i64>(), any::<i64>().prop_map(|it| it >> 11)],
            part in prop_oneof![Just(0.0), Just(0.5), Just(0.499_999_999_999_999_94), Just(0.500_000_000_000_000_1), 0.0..1.0],
            scale in prop_oneof![Just(1.0), Just(1e-3), Just(1e12)],
        ) {
            let number = if signed { Number::Signed } else { Number::Unsigned };
            let layout = Layout { start: 0, size, order: ByteOrder::Little, number };
            let codec = SignalCodec::build(layout, 8, 1.0, 0.0).expect("fits");
            let value = (base as f64 + part) * scale;
            prop_assert_eq!(codec.unscale(value), nearest(layout, value), "{}", value);
        }
    }

    /// Each signal within eight neighbouring bytes is one load: of an aligned word where one holds it, else from its first
    /// byte; and of nothing beyond the payload.
    #[test]
    fn a_signal_is_read_in_one_load_where_eight_bytes_hold_it() {
        for (start, size, order) in (0..512_u16)
            .flat_map(|start| (1..=64_u16).map(move |size| (start, size)))
            .flat_map(|(start, size)| [ByteOrder::Little, ByteOrder::Big].map(|order| (start, size, order)))
        {
            let layout = Layout { start, size, order, number: Number::Unsigned };
            let bytes = walk::occupied(layout);
            let first = bytes.iter().position(|bits| *bits != 0);
            let last = bytes.iter().rposition(|bits| *bits != 0);
            let codec = SignalCodec::build(layout, MAXIMUM_LENGTH, 1.0, 0.0);
            let (Some(first), Some(last), Ok(codec)) = (first, last, codec) else { continue };
            let expected =
                if first / 8 == last / 8 { Some(first / 8 * 8) } else { (last - first < 8).then_some(first) };
            assert_eq!(codec.window.map(usize::from), expected, "{layout:?}");
            assert_eq!(codec.is_in_first_word(), expected == Some(0), "{layout:?}");
        }
    }

    #[test]
    fn no_message_is_longer_than_a_payload() {
        let layout = Layout { start: 0, size: 8, order: ByteOrder::Little, number: Number::Unsigned };
        assert!(SignalCodec::build(layout, MAXIMUM_LENGTH, 1.0, 0.0).is_ok());
        let refused = SignalCodec::build(layout, MAXIMUM_LENGTH + 1, 1.0, 0.0);
        assert_eq!(refused, Err(LayoutError::Outside(65)));
    }

    /// The same where rounding twice shows: a product beyond 53 bits, alone and with an offset of its own size.
    #[test]
    fn integers_are_rounded_once() {
        for (size, factor, offset) in
            [(64_u16, 3_i64, 0_i64), (60, 1_000_003, 0), (50, 1025, 1 << 60), (50, -1025, 1 << 60)]
        {
            let layout = Layout { start: 0, size, order: ByteOrder::Little, number: Number::Unsigned };
            let codec = SignalCodec::build(layout, 8, factor as f64, offset as f64).expect("fits");
            let mut raw = 1_u64;
            for _ in 0..2_000 {
                raw = raw.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let raw = raw >> (64 - size);
                let exact = i128::from(raw) * i128::from(factor) + i128::from(offset);
                assert_eq!(codec.scale(raw), exact as f64, "{raw} * {factor} + {offset}");
            }
        }
    }

    #[test]
    fn what_cannot_carry_a_value_is_refused() {
        let layout = Layout { start: 0, size: 8, order: ByteOrder::Little, number: Number::Unsigned };
        let infinite = f64::INFINITY;
        for (factor, offset) in [
            (0.0, 0.0),
            (infinite, 0.0),
            (f64::NAN, 0.0),
            (1.0, -infinite),
            (1.0, f64::NAN),
            (infinite, infinite),
        ] {
            let refused = SignalCodec::build(layout, 8, factor, offset);
            assert!(matches!(refused, Err(LayoutError::Scaling(..))), "{factor} {offset}: {refused:?}");
        }
    }

    proptest! {
        /// Where raw value, factor and offset are integers, the value is theirs, rounded once: also where the product leaves
        /// the 53 bits of `f64`.
        #[test]
        fn integers_are_scaled_in_integers(
            size in 1_u16..=64, signed: bool, raw: u64, factor in 1_i64..(1 << 40), narrow in 0_u32..40, negative: bool,
            offset in prop_oneof![Just(0_i64), -1000_i64..1000, any::<i64>().prop_map(|it| it >> 3)],
        ) {
            let number = if signed { Number::Signed } else { Number::Unsigned };
            let layout = Layout { start: 0, size, order: ByteOrder::Little, number };
            let factor = (factor >> narrow).max(1) * if negative { -1 } else { 1 };
            // As the codec is given it.
            let offset = offset as f64;
            let codec = SignalCodec::build(layout, 8, factor as f64, offset).expect("fits");
            prop_assert_eq!((codec.factor(), codec.offset()), (factor as f64, offset));
            let mask = u64::MAX >> (64 - size);
            let above = i128::from(raw & mask);
            let integer = if signed && above > i128::from(mask >> 1) { above - (i128::from(mask) + 1) } else { above };
            prop_assert_eq!(codec.scale(raw & mask), (integer * i128::from(factor) + offset as i128) as f64);
        }
    }

    #[test]
    fn what_is_no_number_gives_the_bits_of_zero() {
        let layout = |size| Layout { start: 0, size, order: ByteOrder::Little, number: Number::Signed };
        for size in [8, 51, 52, 64] {
            let codec = SignalCodec::build(layout(size), 8, 0.5, 1.0).expect("fits");
            assert_eq!(codec.unscale(f64::NAN), codec.unscale(0.0), "{size} bits");
            assert_eq!(codec.scale(codec.unscale(0.0)), 0.0, "{size} bits");
            let (least, greatest) = codec.span();
            assert_eq!(codec.scale(codec.unscale(f64::NEG_INFINITY)), least);
            assert_eq!(codec.scale(codec.unscale(f64::INFINITY)), greatest);
        }
    }
}
