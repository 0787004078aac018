//! Hostile input: the DBC loader, the frame decoder and the configuration neither panic nor let through what
//! their documentation excludes. A fixed seed here; `tests/fuzz` looks on for as long as one likes.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rotorbench::can::{
    BusConfig, ByteOrder, Database, Frame, Id, MAXIMUM_LENGTH, NumberFormat, Payload, Roles, SignalCodec,
    SignalLayout, walk,
};
use rotorbench::signal::Sensors;

fn fixed(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(0xCA4),
        failure_persistence: None,
        ..ProptestConfig::with_cases(cases)
    }
}

fn payload() -> impl Strategy<Value = Payload> {
    prop::collection::vec(any::<u8>(), MAXIMUM_LENGTH)
        .prop_map(|bytes| bytes.try_into().expect("the length of a payload"))
}

fn layout() -> impl Strategy<Value = SignalLayout> {
    let order = prop_oneof![Just(ByteOrder::Little), Just(ByteOrder::Big)];
    let number = prop_oneof![
        3 => (1_u16..=64).prop_map(|size| (size, NumberFormat::Unsigned)),
        3 => (1_u16..=64).prop_map(|size| (size, NumberFormat::Signed)),
        1 => Just((32, NumberFormat::Float32)),
        1 => Just((64, NumberFormat::Float64)),
    ];
    (0_u16..512, order, number).prop_map(|(start, order, (size, number))| SignalLayout {
        start,
        size,
        order,
        number,
    })
}

/// One line of a DBC file, mostly of the right form.
fn line() -> impl Strategy<Value = String> {
    let small = prop_oneof![0_u64..70, any::<u64>()];
    let id = prop_oneof![0_u64..4, 0x8000_0000_u64..0x8000_0004, any::<u64>()];
    let number =
        prop_oneof![Just("1".to_owned()), Just("-0.5".to_owned()), any::<f64>().prop_map(|x| x.to_string())];
    let indicator = prop_oneof![Just(""), Just("M"), Just("m0"), Just("m1M"), Just("m99999999999999999999")];
    prop_oneof![
        (id.clone(), small.clone()).prop_map(|(id, length)| format!("BO_ {id} M{id}: {length} A")),
        ("[ab]", indicator, small.clone(), small, "[01]", "[+-]", number.clone(), number).prop_map(
            |(name, indicator, start, size, order, sign, factor, offset)| format!(
                " SG_ {name} {indicator} : {start}|{size}@{order}{sign} ({factor},{offset}) [0|0] \"\" A"
            )
        ),
        (id.clone(), "[ab]", "[0123]")
            .prop_map(|(id, name, kind)| format!("SIG_VALTYPE_ {id} {name} : {kind};")),
        (id, "[ab]", "[ab]").prop_map(|(id, a, b)| format!("SG_MUL_VAL_ {id} {a} {b} 0-1, 5-3;")),
        ".{0,40}",
    ]
}

proptest! {
    #![proptest_config(fixed(20_000))]

    #[test]
    fn the_compiled_signal_agrees_with_the_bitwise_walk(layout in layout(), payload in payload(), raw: u64) {
        let Ok(codec) = SignalCodec::build(layout, MAXIMUM_LENGTH, 1.0, 0.0) else {
            // Refused if and only if some bit lies outside.
            let bits: u32 = walk::occupied(layout).iter().map(|byte| byte.count_ones()).sum();
            prop_assert!(bits < u32::from(layout.size), "{layout:?} fits");
            return Ok(());
        };
        prop_assert_eq!(codec.decode_raw(&payload), walk::decode_raw(layout, &payload));
        let (mut compiled, mut walked) = (payload, payload);
        codec.encode_raw(&mut compiled, raw);
        walk::encode_raw(layout, &mut walked, raw);
        prop_assert_eq!(compiled, walked);
    }

    #[test]
    fn what_is_encoded_comes_back(
        layout in layout(), payload in payload(), factor in -100.0..100.0_f64, offset in -1e3..1e3_f64, part in 0.0..=1.0_f64
    ) {
        let Ok(codec) = SignalCodec::build(layout, MAXIMUM_LENGTH, factor, offset) else { return Ok(()) };
        let (least, greatest) = codec.span();
        let integer = matches!(layout.number, NumberFormat::Unsigned | NumberFormat::Signed);
        let value = if integer { least + part * (greatest - least) } else { part * 1e6 - 5e5 };
        let mut encoded = payload;
        codec.encode(&mut encoded, value);
        // Half a step of an integer; the resolution of the float; and of f64 itself, for the widest.
        let step = if integer { 0.5 * factor.abs() } else { 0.0 };
        let float = if layout.number == NumberFormat::Float32 { 1e-7 } else { 1e-15 };
        let rounding = float * (value.abs() + offset.abs()) + 1e-15 * (greatest - least).min(1e30);
        prop_assert!((codec.decode(&encoded) - value).abs() <= step + 4.0 * rounding, "{codec:?}: {value}");
        for beyond in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            codec.encode(&mut encoded, beyond);
        }
    }
}

proptest! {
    #![proptest_config(fixed(1_500))]

    #[test]
    fn the_dbc_loader_takes_or_refuses_anything(
        lines in prop::collection::vec(line(), 0..12), noise in prop::collection::vec(any::<u8>(), 0..20), data in prop::collection::vec(any::<u8>(), 0..=64)
    ) {
        let mut bytes = format!("VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\n{}\n", lines.join("\n")).into_bytes();
        let _ = Database::parse("noise", &noise);
        if let Ok(database) = Database::parse("fuzz", &bytes) {
            for message in &database.messages {
                let _ = message.decode(&data).count();
            }
        }
        bytes.extend(noise);
        let _ = Database::parse("fuzz", &bytes);
    }

    #[test]
    fn a_broken_shipped_dbc_file_is_taken_or_refused(cut in 0_usize..3000, place in 0_usize..3000, byte: u8) {
        let whole = include_bytes!("../../dbc/bench.dbc");
        let mut bytes = whole[..cut.min(whole.len())].to_vec();
        let _ = Database::parse("cut", &bytes);
        bytes = whole.to_vec();
        let place = place % bytes.len();
        bytes[place] = byte;
        let _ = Database::parse("changed", &bytes);
    }

    #[test]
    fn a_random_frame_is_taken_or_refused(number: u32, extended: bool, data in prop::collection::vec(any::<u8>(), 0..=8)) {
        let roles = Roles::build(&BusConfig::default(), 0.02).expect("sound");
        let (mut state, mut sensors) = (roles.sensor_receiver(), Sensors::default());
        let id = Id::new(number & if extended { 0x1FFF_FFFF } else { 0x7FF }, extended).expect("masked");
        let frame = Frame::classic(id, &data).expect("fits");
        roles.decode_sensors(&mut state, &frame, 1, &mut sensors);
        prop_assert_eq!(state.counts.frames, 1);
    }

    #[test]
    fn a_random_table_is_taken_or_refused(
        message in "[A-Z_]{0,8}|GYRO|COMMAND|ESC_1_STATUS", signal in "[a-z_]{0,8}|rate|speed|rotor_1", unit in prop::option::of("rpm|rad/s|ERPM|[a-z]{0,4}"),
        factor: f64, node in prop::option::of(any::<u32>()), mask in prop::option::of(any::<u32>()), pole_pairs in prop::option::of(0_u32..3),
        minimum in prop::option::of(any::<f64>()), period: f64
    ) {
        let mut config = BusConfig::default();
        for role in config.sensors.values_mut().take(1) {
            role.signal = format!("{message}.{signal}");
            (role.unit, role.factor, role.node, role.pole_pairs, role.minimum) = (unit.clone(), factor, node, pole_pairs, minimum);
        }
        config.database[0].node_mask = mask;
        let _ = Roles::build(&config, period);
        let text = toml::to_string(&config).expect("a table can be written");
        if factor.is_finite() && minimum.is_none_or(f64::is_finite) {
            prop_assert_eq!(toml::from_str::<BusConfig>(&text).expect("and read back"), config);
        }
    }
}
