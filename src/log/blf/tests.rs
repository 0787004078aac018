use std::io::Write as _;

use super::*;
use crate::recording::raw_frame::FrameFlags;

/// An object of the file.
fn object(kind: u32, body: &[u8]) -> Vec<u8> {
    let mut bytes = b"LOBJ".to_vec();
    bytes.extend([16, 0, 1, 0]);
    bytes.extend((16 + body.len() as u32).to_le_bytes());
    bytes.extend(kind.to_le_bytes());
    bytes.extend(body);
    bytes
}

/// A classic frame on channel 2, of one byte, after `ticks` of a unit.
fn frame(unit: u32, ticks: u64, id: u32, byte: u8) -> Vec<u8> {
    let mut body = unit.to_le_bytes().to_vec();
    body.extend([0; 4]);
    body.extend(ticks.to_le_bytes());
    body.extend([2, 0, 0, 1]);
    body.extend(id.to_le_bytes());
    body.extend([byte, 0, 0, 0, 0, 0, 0, 0]);
    object(1, &body)
}

fn container(whole: &[u8], compressed: bool) -> Vec<u8> {
    let mut body = vec![if compressed { 2 } else { 0 }, 0, 0, 0, 0, 0, 0, 0];
    body.extend((whole.len() as u32).to_le_bytes());
    body.extend([0; 4]);
    if compressed {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(whole).expect("to memory");
        body.extend(encoder.finish().expect("to memory"));
    } else {
        body.extend(whole);
    }
    let mut bytes = object(CONTAINER, &body);
    bytes.extend(vec![0; bytes.len() % 4]);
    bytes
}

/// A file that began on 2024-03-01 at 00:00:01.250.
fn file(containers: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = b"LOGG".to_vec();
    bytes.extend(144_u32.to_le_bytes());
    bytes.resize(40, 0);
    bytes.extend([2024_u16, 3, 5, 1, 0, 0, 1, 250].into_iter().flat_map(u16::to_le_bytes));
    bytes.resize(144, 0);
    bytes.extend(containers.concat());
    bytes
}

fn read_all(bytes: &[u8]) -> (Vec<CandumpFrame>, Vec<(&'static str, u64)>) {
    let (frames, skipped) = read(Path::new("a.blf"), bytes).expect("frames");
    (frames, skipped.into_iter().map(|it| (it.code, it.count)).collect())
}

#[test]
fn frames_go_on_from_one_container_into_the_next() {
    let whole = [frame(2, 5_000, 0x123, 7), frame(1, 300, 0x8000_0456, 8)].concat();
    for place in 0..whole.len() {
        let (first, second) = whole.split_at(place);
        let (frames, skipped) = read_all(&file(&[container(first, true), container(second, false)]));
        assert!(skipped.is_empty(), "{place}: {skipped:?}");
        let [first, second] = &frames[..] else { panic!("{place}: {frames:?}") };
        // 19,783 days after 1970.
        let start_ns = (19_783 * 86_400 + 1) * 1_000_000_000 + 250_000_000;
        assert_eq!((first.frame.stamp_ns, second.frame.stamp_ns), (start_ns + 5_000, start_ns + 3_000_000));
        assert_eq!((first.interface.as_str(), first.frame.id, first.frame.payload()), ("2", 0x123, &[7][..]));
        assert_eq!((second.frame.id, second.frame.flags), (0x456, FrameFlags::EXTENDED));
    }
}

#[test]
fn damage_costs_only_what_it_hits() {
    let whole: Vec<Vec<u8>> = (0..4).map(|byte| container(&frame(2, 0, 1, byte), true)).collect();
    let mut broken = file(&whole);
    let place = 144 + whole[0].len() + 40;
    broken[place..place + 6].fill(0xff);
    let (frames, skipped) = read_all(&broken);
    assert_eq!(frames.iter().map(|it| it.frame.data[0]).collect::<Vec<_>>(), [0, 2, 3]);
    assert_eq!(skipped, [("damaged_container", 1)]);
    let bytes = file(&whole);
    let (frames, skipped) = read_all(&bytes[..bytes.len() - 9]);
    assert_eq!((frames.len(), skipped), (3, vec![("cut_off", 1)]));
}

#[test]
fn a_container_of_nothing_but_air_is_refused() {
    let air = container(&vec![0; 10_000_000], true);
    let error =
        read(Path::new("a.blf"), &file(&[container(&frame(2, 0, 1, 1), true), air])).expect_err("too much");
    assert!(error.to_string().contains("more than a recording"), "{error}");
}

#[test]
fn fd_frames_have_up_to_64_bytes() {
    let mut body = 2_u32.to_le_bytes().to_vec();
    body.extend([0; 12]);
    body.extend([1, 9, 12, 0]);
    body.extend(0x77_u32.to_le_bytes());
    body.extend([0; 4]);
    body.extend(0x3000_u32.to_le_bytes());
    body.extend([0; 18]);
    body.extend([1, 0, 0, 0, 0, 0]);
    body.extend(1..=10);
    let (frames, _) = read_all(&file(&[container(&object(101, &body), false)]));
    let frame = &frames[0].frame;
    let flags = FrameFlags::FD | FrameFlags::BIT_RATE_SWITCH | FrameFlags::SENT;
    assert_eq!((frame.flags, frame.payload()), (flags, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 0, 0][..]));
}
