//! A signal read and written bit by bit, straight from the definition in the DBC format: slow, and plain enough
//! to check [`super::codec`] against.

use super::frame::Payload;
use super::layout::{ByteOrder, SignalLayout};

/// Bits of the signal from the least significant on, as (byte, bit in the byte).
///
/// Little-endian: up from the start bit. Big-endian: the start bit is the most significant; a byte is run
/// through downwards, and after its bit 0 comes bit 7 of the byte behind it.
fn places(layout: SignalLayout) -> impl Iterator<Item = (usize, u32)> {
    (0..layout.size).map(move |rank| match layout.order {
        ByteOrder::Little => {
            let position = layout.start + rank;
            (usize::from(position / 8), u32::from(position % 8))
        }
        ByteOrder::Big => {
            let down = layout.size - 1 - rank + (7 - layout.start % 8);
            (usize::from(layout.start / 8 + down / 8), u32::from(7 - down % 8))
        }
    })
}

/// The signal's bits, unextended; bits outside the payload read as 0.
#[must_use]
pub fn decode_raw(layout: SignalLayout, payload: &Payload) -> u64 {
    let mut raw = 0;
    for (rank, (byte, bit)) in places(layout).enumerate() {
        let value = payload.get(byte).map_or(0, |byte| u64::from(byte >> bit & 1));
        raw |= value << rank;
    }
    raw
}

/// Writes the low bits of `raw` into the signal's place and touches no other bit.
pub fn encode_raw(layout: SignalLayout, payload: &mut Payload, raw: u64) {
    for (rank, (byte, bit)) in places(layout).enumerate() {
        if let Some(byte) = payload.get_mut(byte) {
            *byte = *byte & !(1 << bit) | ((raw >> rank & 1) as u8) << bit;
        }
    }
}

/// The bits the signal occupies, as a mask over the payload.
#[must_use]
pub fn occupied(layout: SignalLayout) -> Payload {
    let mut mask = [0; super::frame::MAXIMUM_LENGTH];
    encode_raw(layout, &mut mask, u64::MAX);
    mask
}
