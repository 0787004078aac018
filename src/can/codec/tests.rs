//! Rounding, limits and where signals are loaded from, against their definitions.

use proptest::prelude::*;

use crate::can::codec::*;

/// Rounding and limiting as their definitions say, in integers, without the addition that does it at once.
fn nearest(layout: SignalLayout, number: f64) -> u64 {
    let mask = u64::MAX >> (64 - layout.size);
    let (least, greatest) = match layout.number {
        NumberFormat::Signed => (-i128::from(mask >> 1) - 1, i128::from(mask >> 1)),
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
        let number = if signed { NumberFormat::Signed } else { NumberFormat::Unsigned };
        let layout = SignalLayout { start: 0, size, order: ByteOrder::Little, number };
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
        let layout = SignalLayout { start, size, order, number: NumberFormat::Unsigned };
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
    let layout = SignalLayout { start: 0, size: 8, order: ByteOrder::Little, number: NumberFormat::Unsigned };
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
        let layout =
            SignalLayout { start: 0, size, order: ByteOrder::Little, number: NumberFormat::Unsigned };
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
    let layout = SignalLayout { start: 0, size: 8, order: ByteOrder::Little, number: NumberFormat::Unsigned };
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
        let number = if signed { NumberFormat::Signed } else { NumberFormat::Unsigned };
        let layout = SignalLayout { start: 0, size, order: ByteOrder::Little, number };
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
    let layout =
        |size| SignalLayout { start: 0, size, order: ByteOrder::Little, number: NumberFormat::Signed };
    for size in [8, 51, 52, 64] {
        let codec = SignalCodec::build(layout(size), 8, 0.5, 1.0).expect("fits");
        assert_eq!(codec.unscale(f64::NAN), codec.unscale(0.0), "{size} bits");
        assert_eq!(codec.scale(codec.unscale(0.0)), 0.0, "{size} bits");
        let (least, greatest) = codec.span();
        assert_eq!(codec.scale(codec.unscale(f64::NEG_INFINITY)), least);
        assert_eq!(codec.scale(codec.unscale(f64::INFINITY)), greatest);
    }
}
