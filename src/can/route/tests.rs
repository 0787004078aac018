use crate::can::layout::{ByteOrder, NumberFormat, SignalLayout};
use crate::can::route::*;

fn codec(start: u16, size: u16, length: usize) -> SignalCodec {
    let layout = SignalLayout { start, size, order: ByteOrder::Little, number: NumberFormat::Unsigned };
    SignalCodec::build(layout, length, 0.25, -1.0).expect("fits")
}

/// A signal of that many bits in steps of 0.25 from -1, in a unit twice as large and 3 higher.
fn binding(field: u32, start: u16, size: u16, length: usize) -> Binding<u32> {
    Binding {
        field,
        signal: format!("signal_{field}"),
        unit: String::new(),
        codec: codec(start, size, length),
        scale: 2.0,
        offset: 3.0,
        range: (5.0, 11.0),
        slack: 0.5,
        selectors: Vec::new(),
    }
}

fn counter(start: u16, size: u16, length: usize) -> Option<(String, SignalCodec)> {
    let layout = SignalLayout { start, size, order: ByteOrder::Little, number: NumberFormat::Unsigned };
    Some(("counter".to_owned(), SignalCodec::build(layout, length, 1.0, 0.0).expect("fits")))
}

fn route(id: Id, length: usize, bindings: Vec<Binding<u32>>) -> Route<u32> {
    let name = format!("M{id}");
    Route {
        name,
        id,
        length,
        least_length: length,
        period_s: 0.01,
        counter: None,
        bindings,
        is_one_word: false,
        lacks_node: false,
    }
}

fn payload(bytes: &[u8]) -> Payload {
    let mut payload = [0; 64];
    payload[..bytes.len()].copy_from_slice(bytes);
    payload
}

#[test]
fn a_value_is_good_up_to_its_limits_and_the_slack_of_rounding() {
    let binding = binding(0, 8, 8, 8);
    // (raw / 4 - 1) * 2 + 3: half a unit a step, from 1.
    for (raw, reading) in [
        (6, FrameReading::Refused(FrameRefusal::OutOfRange)),
        (7, FrameReading::Value(4.5)),
        (8, FrameReading::Value(5.0)),
        (20, FrameReading::Value(11.0)),
        (21, FrameReading::Value(11.5)),
        (22, FrameReading::Refused(FrameRefusal::OutOfRange)),
    ] {
        assert_eq!(binding.read(&payload(&[0, raw])), Some(reading), "{raw}");
    }
    // 0 is 5.5 steps below the least raw value: what is sent then says 1.
    assert_eq!(binding.zero_as_sent(), 1.0);
    let reaches = Binding { offset: 1.5, ..binding };
    assert_eq!(reaches.zero_as_sent(), 0.0);
}

#[test]
fn a_signal_of_a_page_is_read_there_alone_and_selects_what_it_needs() {
    let mut paged = binding(0, 16, 8, 8);
    let (_, page) = counter(0, 4, 8).expect("a codec");
    let (_, book) = counter(8, 8, 8).expect("a codec");
    paged.selectors = vec![(page, vec![(3, 3), (5, 6)]), (book, vec![(9, 9)])];
    let good = Some(FrameReading::Value(6.0));
    for (bytes, reading) in [
        ([3, 9, 10], good),
        ([5, 9, 10], good),
        ([6, 9, 10], good),
        ([4, 9, 10], None),
        ([7, 9, 10], None),
        ([3, 8, 10], None),
    ] {
        assert_eq!(paged.read(&payload(&bytes)), reading, "{bytes:?}");
    }
    let frame = route(Id::Standard(1), 3, vec![paged]).emit(&mut 0, |_| 6.0);
    assert_eq!(frame.data(), [3, 9, 10]);
}

/// Put together in one word or written one by one: the same bytes, and the counter steps.
#[test]
fn a_frame_is_the_same_in_one_word_and_signal_by_signal() {
    let bindings = vec![binding(0, 0, 8, 8), binding(1, 12, 12, 8)];
    let slow = Route { counter: counter(60, 4, 8), ..route(Id::Standard(1), 8, bindings) };
    assert!(slow.fits_one_word());
    let fast = Route { is_one_word: true, ..slow.clone() };
    let value = |field| if field == 0 { 6.0 } else { 201.0 };
    let (mut one, mut other) = (15, 15);
    for last in [0xF0, 0x00, 0x10] {
        let frame = slow.emit(&mut one, value);
        // 6 = (10 / 4 - 1) * 2 + 3, 201 = (400 / 4 - 1) * 2 + 3; 400 = 0x190.
        assert_eq!(frame.data(), [10, 0, 0x19, 0, 0, 0, 0, last]);
        assert_eq!(fast.emit(&mut other, value), frame);
    }
}

#[test]
fn one_word_is_for_signals_that_share_no_bit_and_are_always_there() {
    let of = |bindings| route(Id::Standard(1), 16, bindings);
    let fits = |bindings| of(bindings).fits_one_word();
    assert!(fits(vec![binding(0, 0, 8, 16), binding(1, 8, 8, 16), binding(2, 56, 8, 16)]));
    assert!(!fits(vec![binding(0, 0, 8, 16), binding(1, 7, 8, 16)]), "the first two share a bit");
    let three = vec![binding(0, 0, 8, 16), binding(1, 8, 8, 16), binding(2, 4, 4, 16)];
    assert!(!fits(three), "the first and the third do");
    assert!(!fits(vec![binding(0, 0, 8, 16), binding(1, 64, 8, 16)]), "in the second word");
    let counted = Route { counter: counter(4, 8, 16), ..of(vec![binding(0, 0, 8, 16)]) };
    assert!(!counted.fits_one_word(), "counter and signal share bits");
    let paged = Binding { selectors: vec![(codec(0, 8, 16), vec![(1, 1)])], ..binding(0, 8, 8, 16) };
    assert!(!fits(vec![paged]), "not always there");
}

#[test]
fn a_counter_is_as_wide_as_its_signal() {
    let route = Route { counter: counter(4, 4, 8), ..route(Id::Standard(1), 1, vec![binding(0, 0, 4, 8)]) };
    let mut state = Counter::default();
    let mut check = |count: u8| {
        let frame = Frame::classic(Id::Standard(1), &[count << 4 | 7]).expect("fits");
        route.check_counter(&mut state, &frame)
    };
    assert_eq!([check(14), check(15), check(0), check(3)], [Ok(0), Ok(0), Ok(0), Ok(2)]);
    assert_eq!(check(3), Err(FrameRefusal::Counter));
}

/// What arbitration does: the 11 bits that all identifiers begin with decide, a short one wins a tie, then the other 18 do.
#[test]
fn messages_are_in_the_order_of_arbitration() {
    let long = |base: u32, rest| Id::Extended(base << 18 | rest);
    let order = [
        long(0x0FF, 0x3FFFF),
        Id::Standard(0x100),
        long(0x100, 0),
        long(0x100, 1),
        long(0x100, 0x2_0000),
        Id::Standard(0x101),
        long(0x101, 0),
    ];
    let forwards = order.iter().map(|id| route(*id, 2, Vec::new()));
    for messages in [forwards.clone().collect::<Vec<_>>(), forwards.rev().collect()] {
        let routes = Routes::new(messages);
        let found: Vec<Id> = routes.messages().iter().map(|route| route.id).collect();
        assert_eq!(found, order);
        for (index, id) in order.into_iter().enumerate() {
            let at = |frame: Option<Frame>| {
                let frame = frame.expect("fits");
                (routes.find(&frame).map(|(index, route)| (index, route.id)), routes.has(&frame))
            };
            assert_eq!(at(Frame::classic(id, &[1, 2])), (Ok((index, id)), true));
            assert_eq!(at(Frame::classic(id, &[1])), (Err(FrameRefusal::WrongLength), true));
            assert_eq!(at(Frame::remote(id, 2)), (Err(FrameRefusal::UnknownId), false));
        }
        for id in [Id::Standard(0x0FF), Id::Standard(0), Id::Extended(0x100), long(0x100, 2)] {
            let frame = Frame::classic(id, &[1, 2]).expect("fits");
            assert_eq!((routes.find(&frame), routes.has(&frame)), (Err(FrameRefusal::UnknownId), false));
        }
    }
}

#[test]
fn what_is_longer_than_a_classic_frame_is_sent_as_fd() {
    let id = Id::Standard(1);
    let short = route(id, 8, Vec::new());
    assert_eq!((short.needs_fd(), short.emit(&mut 0, |_| 0.0).kind()), (false, FrameKind::Classic));
    let long = route(id, 12, vec![binding(0, 88, 8, 12)]);
    assert!(long.needs_fd());
    let frame = long.emit(&mut 0, |_| 6.0);
    assert_eq!(frame.kind(), FrameKind::Fd { bit_rate_switch: true, error_state: false });
    assert_eq!(frame.data(), [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 10]);
}

#[test]
fn a_refusal_says_its_cause_and_flags_the_value_where_there_is_one() {
    let said = [
        (FrameRefusal::UnknownId, "unknown identifier", 0),
        (FrameRefusal::ForeignCommand, "command of another sender", 0),
        (FrameRefusal::WrongLength, "wrong length", 0),
        (FrameRefusal::Counter, "counter", Health::COUNTER),
        (FrameRefusal::NotANumber, "not a number", Health::NOT_A_NUMBER),
        (FrameRefusal::OutOfRange, "out of range", Health::OUT_OF_RANGE),
    ];
    for (refusal, text, health) in said {
        assert_eq!((refusal.to_string().as_str(), refusal.health()), (text, health));
    }
}

/// Of a frame of eight bytes whose signal ends in byte `least`, a capture's may be as short as that; a bus's never.
#[test]
fn a_frame_of_a_capture_may_lack_what_nobody_reads() {
    let id = Id::Standard(1);
    let big = SignalLayout { start: 39, size: 16, order: ByteOrder::Big, number: NumberFormat::Signed };
    let big = SignalCodec::build(big, 8, 0.1, 0.0).expect("fits");
    let paged = Binding { selectors: vec![(codec(48, 4, 8), vec![(0, 0)])], ..binding(0, 8, 8, 8) };
    let of = |bindings| route(id, 8, bindings);
    for (route, least) in [
        (of(vec![binding(0, 0, 8, 8)]), 1),
        (of(vec![binding(0, 0, 8, 8), binding(1, 12, 12, 8)]), 3),
        (of(vec![binding(0, 0, 9, 8)]), 2),
        (of(vec![Binding { codec: big, ..binding(0, 0, 8, 8) }]), 6),
        (of(vec![paged]), 7),
        (Route { counter: counter(60, 4, 8), ..of(vec![binding(0, 0, 8, 8)]) }, 8),
    ] {
        let bus = Routes::new(vec![route]);
        let capture = bus.of_capture();
        for length in 0..=8 {
            let frame = Frame::classic(id, &[0; 8][..length]).expect("fits");
            let found = |routes: &Routes<u32>| routes.find(&frame).map(|(index, _)| index);
            let expected = |fits| if fits { Ok(0) } else { Err(FrameRefusal::WrongLength) };
            assert_eq!(found(&bus), expected(length == 8), "{length} bytes on a bus");
            assert_eq!(found(&capture), expected(length >= least), "{length} bytes, {least} needed");
        }
    }
    let short = Routes::new(vec![route(id, 2, vec![binding(0, 0, 8, 2)])]).of_capture();
    let longer = Frame::classic(id, &[0; 3]).expect("fits");
    assert_eq!(short.find(&longer).map(|_| ()), Err(FrameRefusal::WrongLength), "longer than the message");
}
