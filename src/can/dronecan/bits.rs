//! Bits of a payload, in the order of DroneCAN v0: a number's bytes come with the low one first, and the bits of each
//! byte, and of the few that are left over, with the high one first, without a hole to whatever stood before.

/// The number of `bits` (1 to 64) bits at bit `at`; `None` when the payload ends before.
#[must_use]
#[inline]
pub(super) fn read(bytes: &[u8], at: usize, bits: u32) -> Option<u64> {
    let (first, skipped) = (at / 8, at % 8);
    let length = (skipped + bits as usize).div_ceil(8);
    let window = bytes.get(first..first.checked_add(length)?)?;
    let word = window.iter().fold(0_u128, |word, byte| word << 8 | u128::from(*byte));
    let unused = 8 * length - skipped - bits as usize;
    Some(in_order((word >> unused) as u64 & mask(bits), bits))
}

/// Writes the low `bits` (1 to 64) of `value` at bit `at` and touches no other; bits beyond the payload are lost.
#[inline]
pub(super) fn write(bytes: &mut [u8], at: usize, bits: u32, value: u64) {
    let (first, skipped) = (at / 8, at % 8);
    let length = (skipped + bits as usize).div_ceil(8);
    let unused = 8 * length - skipped - bits as usize;
    let word = u128::from(as_sent(value & mask(bits), bits)) << unused;
    let touched = u128::from(mask(bits)) << unused;
    for (index, byte) in bytes.iter_mut().skip(first).take(length).enumerate() {
        let shift = 8 * (length - 1 - index);
        *byte = *byte & !((touched >> shift) as u8) | (word >> shift) as u8;
    }
}

/// The lowest `bits`.
pub(super) fn mask(bits: u32) -> u64 {
    u64::MAX >> (64 - bits.clamp(1, 64))
}

/// From the bits as they are sent, the first one highest, to the number.
fn in_order(sent: u64, bits: u32) -> u64 {
    let bytes = u64::from_le_bytes((sent << (64 - bits)).to_be_bytes());
    let (whole, rest) = (bits / 8 * 8, bits % 8);
    if rest == 0 {
        return bytes;
    }
    let last = (bytes >> whole & 0xFF) >> (8 - rest);
    bytes & !(u64::MAX << whole) | last << whole
}

/// From the number to its bits as they are sent, the first one highest.
fn as_sent(value: u64, bits: u32) -> u64 {
    let (whole, rest) = (bits / 8 * 8, bits % 8);
    let bytes = if rest == 0 {
        value
    } else {
        value & !(u64::MAX << whole) | (value >> whole & mask(rest)) << (8 - rest) << whole
    };
    u64::from_be_bytes(bytes.to_le_bytes()) >> (64 - bits)
}

/// The greatest number of a half float.
pub(super) const GREATEST_HALF: f64 = 65_504.0;

/// Exponent bits of binary32.
const EXPONENT: u32 = 0xFF << 23;

/// binary16 from binary32, the nearest; of two the one away from zero. As the reference implementations do it: through a
/// multiplication that makes numbers too small for binary16 what they become there.
#[must_use]
pub(super) fn half_of(value: f32) -> u16 {
    let bits = value.to_bits();
    let (sign, magnitude) = ((bits >> 16) as u16 & 0x8000, bits & 0x7FFF_FFFF);
    if magnitude >= EXPONENT {
        return sign | if magnitude > EXPONENT { 0x7FFF } else { 0x7C00 };
    }
    let scaled = f32::from_bits(magnitude & !0xFFF) * f32::from_bits(15 << 23);
    let rounded = scaled.to_bits().wrapping_add(0x1000).min(31 << 23);
    sign | (rounded >> 13) as u16
}

/// binary32 from binary16, exactly.
#[must_use]
#[inline]
pub(super) fn of_half(half: u16) -> f32 {
    let magnitude = f32::from_bits(u32::from(half & 0x7FFF) << 13) * f32::from_bits((254 - 15) << 23);
    let is_finite = magnitude < f32::from_bits((127 + 16) << 23);
    let bits = magnitude.to_bits() | if is_finite { 0 } else { EXPONENT };
    f32::from_bits(bits | u32::from(half & 0x8000) << 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `int18 = -2` behind two bits: 0x3FFFE is sent as FE FF 11.
    #[test]
    fn bytes_come_low_first_and_bits_high_first() {
        let mut bytes = [0; 4];
        write(&mut bytes, 2, 18, 0x3_FFFE);
        assert_eq!(bytes, [0b0011_1111, 0b1011_1111, 0b1111_0000, 0]);
        assert_eq!(read(&bytes, 2, 18), Some(0x3_FFFE));
        assert_eq!(read(&bytes, 0, 32), Some(u64::from(u32::from_le_bytes(bytes))));
    }

    #[test]
    fn any_number_is_read_as_written_and_its_neighbours_stay() {
        for at in 0..20 {
            for bits in 1..=64 {
                for seed in [0_u64, 1, u64::MAX, 0x0123_4567_89AB_CDEF, 0xFEDC_BA98_7654_3210] {
                    for fill in [0_u8, 0xFF] {
                        let mut bytes = [fill; 12];
                        write(&mut bytes, at, bits, seed);
                        assert_eq!(read(&bytes, at, bits), Some(seed & mask(bits)), "{bits} at {at}");
                        write(&mut bytes, at, bits, if fill == 0 { 0 } else { u64::MAX });
                        assert_eq!(bytes, [fill; 12], "{bits} at {at} touch others");
                    }
                }
            }
        }
        assert_eq!((read(&[0; 4], 1, 32), read(&[], 0, 1)), (None, None));
    }

    #[test]
    fn every_half_is_read_and_written_again() {
        for half in 0..=u16::MAX {
            let value = of_half(half);
            // One pattern stands for all that are not numbers.
            let expected = if value.is_nan() { half & 0x8000 | 0x7FFF } else { half };
            assert_eq!(half_of(value), expected, "{half:#06x} = {value}");
        }
        assert_eq!((of_half(0x3C00), of_half(0xC000), of_half(0x0001)), (1.0, -2.0, 2_f32.powi(-24)));
        assert_eq!((of_half(0x7C00), of_half(0xFC00)), (f32::INFINITY, f32::NEG_INFINITY));
        // Halfway between two: away from zero.
        assert_eq!((half_of(1.0 + 2_f32.powi(-11)), half_of(65_520.0)), (0x3C01, 0x7C00));
    }
}
