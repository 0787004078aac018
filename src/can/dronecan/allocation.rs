//! Dynamic node ids: the one message that both sides speak, `uavcan.protocol.dynamic_node_id.Allocation`.
//!
//! Who has no id says the first six bytes of its unique id, without a sender's number. The allocator says back what it has
//! heard, the next part follows, and after the third it says the whole of it with the node id.

use std::fmt;

use crate::can::error::CanError;
use crate::can::resolve::fail;

use super::assembler::{Subscription, Transfer};
use super::bits;
use super::library::Library;
use super::transfer::{Framing, TransferKind};

/// Name of the message.
const NAME: &str = "uavcan.protocol.dynamic_node_id.Allocation";
/// [byte] of a unique id, and of what a node without an id says of it at once: a frame holds no more.
pub(super) const UNIQUE: usize = 16;
pub(super) const PART: usize = 6;
/// [bit] of the count of these bytes, in FD frames.
const COUNT_BITS: u32 = 5;
/// [byte] of the longest message.
pub(super) const LONGEST: usize = 1 + UNIQUE;

/// What tells a node from every other one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UniqueId(pub [u8; UNIQUE]);

impl UniqueId {
    /// The one that this text is: 32 hexadecimal digits.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let digits = text.as_bytes();
        if digits.len() != 2 * UNIQUE || !digits.iter().all(u8::is_ascii_hexdigit) {
            return None;
        }
        let mut bytes = [0; UNIQUE];
        for (byte, pair) in bytes.iter_mut().zip(digits.chunks(2)) {
            *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
        }
        Some(Self(bytes))
    }
}

impl fmt::Display for UniqueId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

/// The message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AllocationMessage<'a> {
    /// The id that is given or wished; 0 = none.
    pub node_id: u8,
    pub is_first_part: bool,
    /// Bytes of the unique id, 16 at most.
    pub unique_id: &'a [u8],
}

impl<'a> AllocationMessage<'a> {
    pub fn parse(payload: &'a [u8]) -> Option<Self> {
        let (first, unique_id) = payload.split_first()?;
        let (node_id, is_first_part) = (first >> 1, first & 1 != 0);
        (unique_id.len() <= UNIQUE).then_some(Self { node_id, is_first_part, unique_id })
    }

    /// The same of a payload in such frames; bytes of FD frames are moved into `room`.
    pub fn of_transfer(transfer: &Transfer<'a>, room: &'a mut [u8; LONGEST]) -> Option<Self> {
        if transfer.framing == Framing::Classic {
            return Self::parse(transfer.payload);
        }
        let count = bits::read(transfer.payload, 8, COUNT_BITS)? as usize;
        let message = room.get_mut(..=count)?;
        let (first, bytes) = message.split_first_mut()?;
        *first = *transfer.payload.first()?;
        for (index, place) in bytes.iter_mut().enumerate() {
            *place = bits::read(transfer.payload, 8 + COUNT_BITS as usize + 8 * index, 8)? as u8;
        }
        Self::parse(message)
    }

    /// Its payload, in classical frames, whatever the bus carries: as flight controllers have it, and libcanard, which sends no
    /// more than seven bytes without a node id.
    pub fn emit(&self) -> Vec<u8> {
        let mut payload = Vec::with_capacity(LONGEST);
        payload.push(self.node_id << 1 | u8::from(self.is_first_part));
        payload.extend_from_slice(self.unique_id.get(..UNIQUE).unwrap_or(self.unique_id));
        payload
    }
}

/// Listens to the message, of nodes with an id and without.
pub(super) fn subscription(library: &Library) -> Result<Subscription, CanError> {
    let missing = || fail("dronecan", format!("no type `{NAME}`"));
    let compound = library.get(NAME).ok_or_else(missing)?;
    let (message, id) = compound.message().zip(compound.id).ok_or_else(missing)?;
    Ok(Subscription::new(id, TransferKind::Message, compound.signature, message.most_bits()))
}

#[cfg(test)]
mod tests {
    use super::super::dsdl::Structure;
    use super::super::transfer::TransferHeader;
    use super::super::value::{Value, decode, encode};
    use super::*;

    /// As the published definition says it.
    #[test]
    fn the_message_is_the_published_one() {
        let library = Library::build(&[]).expect("sound");
        let structure: &Structure = library.get(NAME).and_then(|it| it.message()).expect("published");
        let bytes: Vec<u8> = (200..216).collect();
        for (node_id, is_first_part, length) in
            [(0, true, 6), (125, false, 16), (127, true, 0), (1, false, 4)]
        {
            let message = AllocationMessage { node_id, is_first_part, unique_id: &bytes[..length] };
            let unique = bytes[..length].iter().map(|it| Value::Integer(i128::from(*it))).collect();
            let value = Value::List(vec![
                Value::Integer(i128::from(node_id)),
                Value::Integer(i128::from(is_first_part)),
                Value::List(unique),
            ]);
            assert_eq!(message.emit(), encode(structure, &value, Framing::Classic).expect("of this type"));
            assert_eq!(decode(structure, &message.emit(), Framing::Classic), Ok(value.clone()));
            assert_eq!(AllocationMessage::parse(&message.emit()), Some(message));
            let fd = encode(structure, &value, Framing::Fd).expect("of this type");
            let header = TransferHeader::message(24, 1, 0);
            for (framing, payload) in [(Framing::Classic, message.emit()), (Framing::Fd, fd)] {
                let (transfer_id, stamp_ns, lost, subscription) = (0, 0, 0, 0);
                let payload = &payload[..];
                let transfer =
                    Transfer { subscription, header, framing, transfer_id, stamp_ns, lost, payload };
                let mut room = [0; LONGEST];
                assert_eq!(AllocationMessage::of_transfer(&transfer, &mut room), Some(message));
            }
        }
        assert_eq!(AllocationMessage::parse(&[]), None);
        assert_eq!(AllocationMessage::parse(&[0; 18]), None);
    }

    #[test]
    fn a_unique_id_is_read_as_it_is_written() {
        let id = UniqueId([0, 1, 0xAB, 0xFF, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
        assert_eq!(UniqueId::parse(&id.to_string()), Some(id));
        for text in ["", "00", &"g".repeat(32), &"ä".repeat(16), &"0".repeat(33), &"+1".repeat(16)] {
            assert_eq!(UniqueId::parse(text), None, "{text}");
        }
    }
}
