//! The encodings of values within a page. Each reads as many values as asked for, or says that the bytes are damaged (`None`).

use super::number::{NumberConversion, Physical};
use super::thrift::{unzigzag, varint};
use crate::log::bytes::Bytes;

/// A miniblock of more values no writer makes.
const LONGEST_MINIBLOCK: u64 = 1 << 16;

/// Values one behind the other.
pub(super) fn plain(
    bytes: &[u8],
    number: &NumberConversion,
    count: usize,
    values: &mut Vec<f64>,
) -> Option<()> {
    if number.physical == Physical::Truth {
        return truths(bytes, count, values);
    }
    let bytes = bytes.get(..count.checked_mul(number.size())?)?;
    values.extend(bytes.chunks_exact(number.size()).map(|bytes| number.value(bytes)));
    Some(())
}

/// A bit each, the lowest first.
fn truths(bytes: &[u8], count: usize, values: &mut Vec<f64>) -> Option<()> {
    let bytes = bytes.get(..count.div_ceil(8))?;
    let bits = bytes.iter().flat_map(|byte| (0..8).map(move |bit| f64::from(byte >> bit & 1)));
    values.extend(bits.take(count));
    Some(())
}

/// Runs of one value, and values in few bits each: `each` takes a value and how often it comes.
pub(super) fn hybrid(
    bytes: &[u8],
    width: u32,
    count: usize,
    mut each: impl FnMut(u32, usize) -> Option<()>,
) -> Option<()> {
    let mut bytes = Bytes::new(bytes);
    let mut left = count;
    let whole = usize::try_from(width).ok().filter(|width| *width <= 32)?;
    while left > 0 {
        let head = varint(&mut bytes)?;
        let length = usize::try_from(head >> 1).ok().filter(|length| *length > 0)?;
        if head & 1 == 0 {
            let mut value = [0; 4];
            value.get_mut(..whole.div_ceil(8))?.copy_from_slice(bytes.take(whole.div_ceil(8))?);
            let length = length.min(left);
            each(u32::from_le_bytes(value), length)?;
            left -= length;
        } else {
            // Groups of eight; the last may break off with the page.
            let packed = bytes.take(length.checked_mul(whole)?.min(bytes.rest().len()))?;
            let length = length.checked_mul(8)?.min(left);
            let mut bits = Bits::new(packed);
            for _ in 0..length {
                each(u32::try_from(bits.take(width)?).ok()?, 1)?;
            }
            left -= length;
        }
    }
    Some(())
}

/// Values by their place in a dictionary.
pub(super) fn by_dictionary(
    bytes: &[u8],
    dictionary: &[f64],
    count: usize,
    values: &mut Vec<f64>,
) -> Option<()> {
    if count == 0 {
        return Some(());
    }
    let (width, bytes) = bytes.split_first()?;
    hybrid(bytes, u32::from(*width), count, |place, times| {
        let value = *dictionary.get(usize::try_from(place).ok()?)?;
        values.extend(std::iter::repeat_n(value, times));
        Some(())
    })
}

/// Truth values in runs, their length before them.
pub(super) fn truths_in_runs(bytes: &[u8], count: usize, values: &mut Vec<f64>) -> Option<()> {
    let mut bytes = Bytes::new(bytes);
    let length = usize::try_from(bytes.u32()?).ok()?;
    hybrid(bytes.take(length)?, 1, count, |truth, times| {
        values.extend(std::iter::repeat_n(f64::from(truth), times));
        Some(())
    })
}

/// Integers as differences, in blocks.
pub(super) fn differences(
    bytes: &[u8],
    number: &NumberConversion,
    count: usize,
    values: &mut Vec<f64>,
) -> Option<()> {
    let mut bytes = Bytes::new(bytes);
    let (block, miniblocks, total) = (varint(&mut bytes)?, varint(&mut bytes)?, varint(&mut bytes)?);
    let mut last = unzigzag(varint(&mut bytes)?);
    let in_miniblock = block.checked_div(miniblocks).filter(|it| (1..=LONGEST_MINIBLOCK).contains(it))?;
    if total != count as u64 {
        return None;
    }
    let narrow = number.physical == Physical::I32;
    let value = |integer: i64| number.of_integer(if narrow { i64::from(integer as i32) } else { integer });
    let mut left = count;
    if left > 0 {
        values.push(value(last));
        left -= 1;
    }
    while left > 0 {
        let least = unzigzag(varint(&mut bytes)?);
        let widths = bytes.take(usize::try_from(miniblocks).ok()?)?;
        for width in widths.iter().map(|width| u32::from(*width)) {
            if left == 0 {
                break;
            }
            let size = in_miniblock.checked_mul(u64::from(width))?.div_ceil(8);
            let mut bits = Bits::new(bytes.take(usize::try_from(size).ok()?)?);
            let length = left.min(usize::try_from(in_miniblock).ok()?);
            for _ in 0..length {
                // Sums may run over by design.
                last = last.wrapping_add(least).wrapping_add(bits.take(width)? as i64);
                values.push(value(last));
            }
            left -= length;
        }
    }
    Some(())
}

/// First the first bytes of all values, then the second ones.
pub(super) fn split_streams(
    bytes: &[u8],
    number: &NumberConversion,
    count: usize,
    values: &mut Vec<f64>,
) -> Option<()> {
    let size = number.size();
    let bytes = bytes.get(..count.checked_mul(size)?)?;
    let mut value = [0; 16];
    let value = value.get_mut(..size).filter(|value| !value.is_empty())?;
    for row in 0..count {
        for (to, from) in value.iter_mut().zip(bytes.iter().skip(row).step_by(count)) {
            *to = *from;
        }
        values.push(number.value(value));
    }
    Some(())
}

/// Numbers of some bits each, the lowest first.
struct Bits<'a> {
    bytes: std::slice::Iter<'a, u8>,
    held: u128,
    count: u32,
}

impl<'a> Bits<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes: bytes.iter(), held: 0, count: 0 }
    }

    /// The next number of up to 64 bits.
    fn take(&mut self, width: u32) -> Option<u64> {
        if width > 64 {
            return None;
        }
        while self.count < width {
            self.held |= u128::from(*self.bytes.next()?) << self.count;
            self.count += 8;
        }
        let number = self.held & ((1 << width) - 1);
        self.held >>= width;
        self.count -= width;
        u64::try_from(number).ok()
    }
}
