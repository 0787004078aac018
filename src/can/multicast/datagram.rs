//! One CAN frame in one datagram, as DroneCAN's reference implementation packs it (`dronecan/driver/mcast.py` of PyPI `dronecan`).
//!
//! All numbers low byte first: `0x2934`, the checksum of all that follows it (CRC-16-CCITT from 0xFFFF), flags (1 = CAN FD),
//! the identifier (bit 31: of 29 bits), then up to 64 bytes of data.

use crate::can::dronecan::crc::transfer_crc;
use crate::can::frame::{Frame, FrameKind, Id, MAXIMUM_LENGTH};

const MAGIC: u16 = 0x2934;
const FLAG_FD: u16 = 1;
/// Of the identifier: it has 29 bits.
const EXTENDED: u32 = 1 << 31;
const IDENTIFIER: u32 = 0x1FFF_FFFF;
/// [byte] what the checksum is of begins here, and the data.
const CHECKED_FROM: usize = 4;
const HEADER: usize = 10;
/// [byte] of the longest one.
pub(super) const LONGEST: usize = HEADER + MAXIMUM_LENGTH;

fn checksum(bytes: &[u8]) -> u16 {
    transfer_crc(0xFFFF, bytes)
}

/// The datagram that carries `frame`, in the beginning of `buffer`; `None` of a remote request, which has no place there.
pub(super) fn emit<'a>(frame: &Frame, buffer: &'a mut [u8; LONGEST]) -> Option<&'a [u8]> {
    let flags = match frame.kind() {
        FrameKind::Remote => return None,
        FrameKind::Classic => 0,
        FrameKind::Fd { .. } => FLAG_FD,
    };
    let id = frame.id().number() | if frame.id().is_extended() { EXTENDED } else { 0 };
    let end = HEADER + frame.data().len();
    buffer.get_mut(4..6)?.copy_from_slice(&flags.to_le_bytes());
    buffer.get_mut(6..HEADER)?.copy_from_slice(&id.to_le_bytes());
    buffer.get_mut(HEADER..end)?.copy_from_slice(frame.data());
    let crc = checksum(buffer.get(CHECKED_FROM..end)?);
    buffer.get_mut(..2)?.copy_from_slice(&MAGIC.to_le_bytes());
    buffer.get_mut(2..CHECKED_FROM)?.copy_from_slice(&crc.to_le_bytes());
    buffer.get(..end)
}

/// The frame in a datagram; `None` where it is none, is damaged, or is one that no bus could carry. FD frames only where the bus
/// has them.
pub(super) fn parse(bytes: &[u8], fd: bool) -> Option<Frame> {
    let number = |at: usize| Some(u16::from_le_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]));
    if number(0)? != MAGIC || number(2)? != checksum(bytes.get(CHECKED_FROM..)?) {
        return None;
    }
    let is_fd = number(4)? & FLAG_FD != 0;
    let id = u32::from(number(6)?) | u32::from(number(8)?) << 16;
    // What is neither identifier nor its width marks remote requests and error frames elsewhere.
    if id & !(EXTENDED | IDENTIFIER) != 0 || is_fd && !fd {
        return None;
    }
    let kind =
        if is_fd { FrameKind::Fd { bit_rate_switch: false, error_state: false } } else { FrameKind::Classic };
    Frame::new(Id::new(id & IDENTIFIER, id & EXTENDED != 0)?, kind, bytes.get(HEADER..)?)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// What PyPI's dronecan 1.0.26 sent: a `NodeStatus` of node 126, a frame with an identifier of 11 bits.
    const GOLDEN: &[(&str, Id, &[u8])] = &[
        ("3429c39100007e55019801000000000000c0", Id::Extended(0x1801_557E), &[1, 0, 0, 0, 0, 0, 0, 0xC0]),
        ("3429e2a9000023010000abcd", Id::Standard(0x123), &[0xAB, 0xCD]),
    ];

    fn unhex(text: &str) -> Vec<u8> {
        let pair = |at| u8::from_str_radix(&text[2 * at..2 * at + 2], 16).expect("hexadecimal");
        (0..text.len() / 2).map(pair).collect()
    }

    #[test]
    fn a_datagram_is_that_of_the_reference() {
        for (hex, id, data) in GOLDEN {
            let bytes = unhex(hex);
            let frame = Frame::classic(*id, data).expect("fits");
            assert_eq!(emit(&frame, &mut [0; LONGEST]).expect("a data frame"), bytes);
            assert_eq!(parse(&bytes, false), Some(frame));
        }
        let fd = "3429fafd01007e550198000102030405060708090a0b";
        let kind = FrameKind::Fd { bit_rate_switch: false, error_state: false };
        let data: Vec<u8> = (0..12).collect();
        let frame = Frame::new(Id::Extended(0x1801_557E), kind, &data).expect("fits");
        assert_eq!(parse(&unhex(fd), true), Some(frame));
        assert_eq!(emit(&frame, &mut [0; LONGEST]).expect("a data frame"), unhex(fd));
    }

    #[test]
    fn what_is_no_frame_of_the_bus_is_refused() {
        let frame = Frame::classic(Id::Extended(5), &[1, 2]).expect("fits");
        let mut buffer = [0; LONGEST];
        let good = emit(&frame, &mut buffer).expect("a data frame").to_vec();
        assert_eq!(emit(&Frame::remote(Id::Extended(5), 2).expect("fits"), &mut [0; LONGEST]), None);
        for at in 0..good.len() {
            for bit in 0..8 {
                let mut bad = good.clone();
                bad[at] ^= 1 << bit;
                assert_eq!(parse(&bad, true), None, "byte {at}, bit {bit}");
            }
            assert_eq!(parse(&good[..at], true), None, "{at} bytes");
        }
        let with = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = good.clone();
            change(&mut bytes);
            let crc = checksum(&bytes[CHECKED_FROM..]).to_le_bytes();
            bytes[2..4].copy_from_slice(&crc);
            bytes
        };
        assert_eq!(parse(&with(&|bytes| bytes[9] |= 0x40), true), None, "a remote request");
        assert_eq!(parse(&with(&|bytes| bytes[9] &= 0x7F), true).map(|it| it.id()), Some(Id::Standard(5)));
        assert_eq!(parse(&with(&|bytes| bytes[7..10].copy_from_slice(&[8, 0, 0])), true), None, "11 bits");
        assert_eq!(parse(&with(&|bytes| bytes.extend([0; 7])), true), None, "nine bytes without FD");
        let fd = with(&|bytes| {
            bytes[4] |= 1;
            bytes.extend([0; 10]);
        });
        assert_eq!(parse(&fd, true).map(|it| it.length()), Some(12));
        assert_eq!(parse(&fd, false), None, "an FD frame on a classical bus");
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..100)) {
            let _ = parse(&bytes, true);
        }

        #[test]
        fn a_frame_comes_back(id in 0..0x2000_0000_u32, data in prop::collection::vec(any::<u8>(), 0..9), fd in any::<bool>()) {
            let kind = if fd { FrameKind::Fd { bit_rate_switch: false, error_state: false } } else { FrameKind::Classic };
            let frame = Frame::new(Id::Extended(id), kind, &data).expect("fits");
            let mut buffer = [0; LONGEST];
            prop_assert_eq!(parse(emit(&frame, &mut buffer).expect("a data frame"), true), Some(frame));
        }
    }
}
