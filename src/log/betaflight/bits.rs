//! How a blackbox log packs numbers into bytes. From the firmware's encoder (`blackbox_encoding.c`), turned around.

/// Why a frame ends before its fields do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BrokenOff;

/// A place in the bytes of one flight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    /// Bytes from the start of `bytes`.
    pub(super) at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }

    /// The next byte.
    pub(super) fn byte(&mut self) -> Result<u8, BrokenOff> {
        let byte = *self.bytes.get(self.at).ok_or(BrokenOff)?;
        self.at += 1;
        Ok(byte)
    }

    /// The next byte, left where it is.
    pub(super) fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Whether the next bytes are these.
    pub(super) fn starts_with(&self, expected: &[u8]) -> bool {
        self.bytes.get(self.at..).is_some_and(|rest| rest.starts_with(expected))
    }

    /// Leaves bytes out.
    pub(super) fn skip(&mut self, count: usize) -> Result<(), BrokenOff> {
        let at = self.at.checked_add(count).filter(|at| *at <= self.bytes.len()).ok_or(BrokenOff)?;
        self.at = at;
        Ok(())
    }

    /// Seven bits a byte, the lowest first; the top bit says that more follow. More than five bytes are no number: 0, as the
    /// firmware's own tools read it.
    pub(super) fn unsigned(&mut self) -> Result<u32, BrokenOff> {
        let mut value = 0_u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Ok(0)
    }

    /// As [`Self::unsigned`], with the sign in the lowest bit.
    pub(super) fn signed(&mut self) -> Result<i32, BrokenOff> {
        let value = self.unsigned()?;
        Ok((value >> 1).cast_signed() ^ -(value & 1).cast_signed())
    }

    /// `count` bytes, the lowest first, with their sign.
    fn little(&mut self, count: u32) -> Result<i32, BrokenOff> {
        let mut value = 0_u32;
        for place in 0..count {
            value |= u32::from(self.byte()?) << (8 * place);
        }
        Ok(sign(value, 8 * count))
    }

    /// Three numbers under a tag of two bits: of 2, 4 or 6 bits each, or of 1 to 4 bytes each.
    pub(super) fn tag2_3s32(&mut self, values: &mut [i32; 8]) -> Result<(), BrokenOff> {
        let lead = u32::from(self.byte()?);
        match lead >> 6 {
            0 => set(values, [sign(lead >> 4, 2), sign(lead >> 2, 2), sign(lead, 2)]),
            1 => {
                let next = u32::from(self.byte()?);
                set(values, [sign(lead, 4), sign(next >> 4, 4), sign(next, 4)]);
            }
            2 => {
                let (second, third) = (u32::from(self.byte()?), u32::from(self.byte()?));
                set(values, [sign(lead, 6), sign(second, 6), sign(third, 6)]);
            }
            _ => self.three_sizes(lead, values)?,
        }
        Ok(())
    }

    /// As [`Self::tag2_3s32`], with 5, 5, 4 and 8, 7, 7 bits in the middle.
    pub(super) fn tag2_3svariable(&mut self, values: &mut [i32; 8]) -> Result<(), BrokenOff> {
        let lead = u32::from(self.byte()?);
        match lead >> 6 {
            0 => set(values, [sign(lead >> 4, 2), sign(lead >> 2, 2), sign(lead, 2)]),
            1 => {
                let all = lead << 8 | u32::from(self.byte()?);
                set(values, [sign(all >> 9, 5), sign(all >> 4, 5), sign(all, 4)]);
            }
            2 => {
                let all = lead << 16 | u32::from(self.byte()?) << 8 | u32::from(self.byte()?);
                set(values, [sign(all >> 14, 8), sign(all >> 7, 7), sign(all, 7)]);
            }
            _ => self.three_sizes(lead, values)?,
        }
        Ok(())
    }

    /// Three numbers, whose sizes in bytes are in the low bits of `lead`, the first one's lowest.
    fn three_sizes(&mut self, lead: u32, values: &mut [i32; 8]) -> Result<(), BrokenOff> {
        for (place, value) in values.iter_mut().take(3).enumerate() {
            *value = self.little(1 + (lead >> (2 * place) & 3))?;
        }
        Ok(())
    }

    /// Four numbers of 0, 4, 8 or 16 bits by a byte of sizes; halves of bytes are shared, the upper one first.
    pub(super) fn tag8_4s16(&mut self, values: &mut [i32; 8]) -> Result<(), BrokenOff> {
        let sizes = self.byte()?;
        let mut half = None;
        for (place, value) in values.iter_mut().take(4).enumerate() {
            let halves = [0, 1, 2, 4][usize::from(sizes >> (2 * place) & 3)];
            let mut bits = 0_u32;
            for _ in 0..halves {
                let next = match half.take() {
                    Some(low) => low,
                    None => {
                        let byte = self.byte()?;
                        half = Some(byte & 0x0f);
                        byte >> 4
                    }
                };
                bits = bits << 4 | u32::from(next);
            }
            *value = sign(bits, 4 * halves);
        }
        Ok(())
    }

    /// As [`Self::tag8_4s16`] in logs of data version 1: two halves always share a byte, the lower one first, and 16 bits come
    /// low byte first.
    pub(super) fn tag8_4s16_first(&mut self, values: &mut [i32; 8]) -> Result<(), BrokenOff> {
        let sizes = self.byte()?;
        let mut high = None;
        for (place, value) in values.iter_mut().take(4).enumerate() {
            // The second of two halves has no size of its own: the byte holds both.
            if let Some(half) = high.take() {
                *value = half;
                continue;
            }
            *value = match sizes >> (2 * place) & 3 {
                0 => 0,
                1 => {
                    let byte = u32::from(self.byte()?);
                    high = Some(sign(byte >> 4, 4));
                    sign(byte, 4)
                }
                2 => self.little(1)?,
                _ => self.little(2)?,
            };
        }
        Ok(())
    }

    /// `count` numbers, 8 at most: a byte says which of them are not zero; a single one comes without it.
    pub(super) fn tag8_8svb(&mut self, count: usize, values: &mut [i32; 8]) -> Result<(), BrokenOff> {
        let present = if count == 1 { 1 } else { self.byte()? };
        for (place, value) in values.iter_mut().take(count).enumerate() {
            *value = if present >> place & 1 == 1 { self.signed()? } else { 0 };
        }
        Ok(())
    }
}

/// The low `bits` of a word as a number with a sign.
pub(super) fn sign(word: u32, bits: u32) -> i32 {
    let above = 32 - bits.min(32);
    word.checked_shl(above).map_or(0, |shifted| shifted.cast_signed() >> above)
}

fn set(values: &mut [i32; 8], three: [i32; 3]) {
    let [first, second, third] = three;
    [values[0], values[1], values[2]] = [first, second, third];
}

#[cfg(test)]
mod tests {
    use super::*;

    type Packed = fn(&mut Cursor<'static>, &mut [i32; 8]) -> Result<(), BrokenOff>;

    fn read(bytes: &'static [u8], with: Packed) -> Vec<i32> {
        let mut values = [99; 8];
        let mut cursor = Cursor::new(bytes, 0);
        with(&mut cursor, &mut values).expect("whole");
        assert_eq!(cursor.at, bytes.len(), "all bytes are read");
        values.into_iter().filter(|value| *value != 99).collect()
    }

    #[test]
    fn bytes_are_the_numbers_that_the_firmware_packs_so() {
        // Written out by hand from the encoder's comments: ss11 2233 and so on.
        assert_eq!(read(&[0b0001_1011], Cursor::tag2_3s32), [1, -2, -1]);
        assert_eq!(read(&[0b0100_0111, 0b1000_1111], Cursor::tag2_3s32), [7, -8, -1]);
        assert_eq!(read(&[0b1001_1111, 0b0010_0000, 0xff], Cursor::tag2_3s32), [31, -32, -1]);
        assert_eq!(
            read(&[0b1110_0100, 0x80, 0x00, 0x80, 0xff, 0xff, 0x7f], Cursor::tag2_3s32),
            [-128, -32_768, 8_388_607]
        );
        assert_eq!(read(&[0b1100_0011, 0x00, 0x00, 0x00, 0x80, 5, 6], Cursor::tag2_3s32), [i32::MIN, 5, 6]);
        assert_eq!(read(&[0b0101_1111, 0b0000_0111], Cursor::tag2_3svariable), [15, -16, 7]);
        assert_eq!(read(&[0b1010_0000, 0b0001_1111, 0b1000_0000], Cursor::tag2_3svariable), [-128, 63, 0]);
    }

    #[test]
    fn four_numbers_share_bytes() {
        // Sizes from the low bits: 4, 8, 16 and 0 bits; then 0, 4, 4 and 8.
        assert_eq!(read(&[0b0011_1001, 0xf8, 0x01, 0x23, 0x40], Cursor::tag8_4s16), [-1, -128, 0x1234, 0]);
        assert_eq!(read(&[0b1001_0100, 0x7f, 0x81], Cursor::tag8_4s16), [0, 7, -1, -127]);
        assert_eq!(read(&[0b1110_0101, 0x2f, 0x03, 0x80, 0xff], Cursor::tag8_4s16_first), [-1, 2, 3, -128]);
    }

    #[test]
    fn numbers_of_many_bytes_and_of_none() {
        let mut cursor =
            Cursor::new(&[0xff, 0xff, 0xff, 0xff, 0x0f, 0x03, 0x80, 0x80, 0x80, 0x80, 0x80, 7], 0);
        assert_eq!(cursor.unsigned(), Ok(u32::MAX));
        assert_eq!(cursor.signed(), Ok(-2));
        assert_eq!(cursor.unsigned(), Ok(0), "six bytes are no number");
        assert_eq!(cursor.unsigned(), Ok(7));
        assert_eq!(cursor.unsigned(), Err(BrokenOff));
        assert_eq!(read(&[0b0000_0101, 2, 3], |cursor, values| cursor.tag8_8svb(3, values)), [1, 0, -2]);
        assert_eq!(read(&[4], |cursor, values| cursor.tag8_8svb(1, values)), [2]);
    }
}
