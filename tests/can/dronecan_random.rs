//! Whatever a bus of DroneCAN may carry: any frames, in any order, any payload, any definition.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rotorbench::can::dronecan::{Assembler, Definition, Framing, Library, TransferHeader, decode, encode};
use rotorbench::can::{Frame, FrameKind, Id};

use super::dronecan::{LIBRARY, listening, same};

const MS: u64 = 1_000_000;

fn fixed(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(0xD20),
        failure_persistence: None,
        ..ProptestConfig::with_cases(cases)
    }
}

proptest! {
    #![proptest_config(fixed(256))]

    /// Any frames: no panic, and whatever comes out whole is no longer than its type.
    #[test]
    fn any_frames_are_taken_or_refused(
        frames in prop::collection::vec(
            (0_u8..4, 1_u8..3, prop::collection::vec(any::<u8>(), 0..64), 0_u8..8, any::<bool>()), 1..200
        )
    ) {
        let names = ["esc.Status", "esc.RawCommand", "ahrs.RawIMU"].map(|it| format!("uavcan.equipment.{it}"));
        let all = names.iter().map(|name| listening(name).1);
        let mut assembler = Assembler::new(all.collect());
        for (index, (of, source, mut data, tail, is_fd)) in frames.into_iter().enumerate() {
            let type_id = [1034, 1030, 1003, 7][usize::from(of)];
            // Few numbers of transfers, so that some come together.
            let fd = FrameKind::Fd { bit_rate_switch: true, error_state: false };
            let kind = if is_fd { fd } else { FrameKind::Classic };
            // As long as a frame of its kind can be.
            let mut lengths = [7, 11, 15, 19, 23, 31, 47, 63].into_iter().rev();
            let least = lengths.find(|it| is_fd && *it <= data.len());
            data.truncate(least.unwrap_or(7));
            let bytes: Vec<u8> = data.into_iter().chain([tail << 5]).collect();
            let id = Id::Extended(TransferHeader::message(8, type_id, source).id());
            let frame = Frame::new(id, kind, &bytes).expect("a length that there is");
            if let Ok(Some(transfer)) = assembler.receive(&frame, index as u64 * 10 * MS) {
                let (subscription, length) = (transfer.subscription, transfer.payload.len());
                let padding = if transfer.framing == Framing::Fd { 15 } else { 0 };
                let filled = assembler.subscriptions()[subscription].most + padding;
                prop_assert!(length <= filled.max(7));
            }
        }
    }

    /// Any bytes are a message or are refused; what is read is written as the same bits.
    #[test]
    fn any_payload_is_read_or_refused(
        bytes in prop::collection::vec(any::<u8>(), 0..160), fd in any::<bool>(), which in any::<prop::sample::Index>()
    ) {
        let all: Vec<_> = LIBRARY.types().filter_map(|it| it.message()).collect();
        let (message, framing) = (which.get(&all), Framing::of_bus(fd));
        if let Ok(value) = decode(message, &bytes, framing) {
            let again = encode(message, &value, framing).expect("of this type");
            let once_more = decode(message, &again, framing).expect("as written");
            prop_assert!(same(&value, &once_more), "{value:?}, {once_more:?}");
        }
    }

    /// Any text is a definition or is refused with a short sentence.
    #[test]
    fn any_definition_is_understood_or_refused(
        lines in prop::collection::vec(
            "(truncated )?(u?int|float|void|bool|Own|a\\.B)[0-9]{0,3}(\\[(<|<=)?[0-9]{1,5}\\])? ?[a-z_]{0,3}( = .{0,5})?|---|@union|#.*|.{0,20}",
            0..12,
        )
    ) {
        let text = lines.join("\n");
        let definition = Definition::new("20000.Own.uavcan", "own", text).expect("named");
        if let Err(error) = Library::build(&[definition]) {
            prop_assert!(error.to_string().starts_with("20000.Own.uavcan:"), "{error}");
        }
    }
}
