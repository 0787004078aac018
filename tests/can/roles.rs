//! Roles: what frames of every kind, good and bad, do to sensors and commands.

use std::f64::consts::TAU;

use proptest::prelude::*;
use rotorbench::can::{
    BusConfig, CommandField, DatabaseConfig, Frame, FrameRefusal, Id, MessageConfig, Roles, RotorCommands,
    SignalConfig,
};
use rotorbench::signal::{Applied, Channel, Health, Sample, Sensors};

fn bench() -> Roles {
    Roles::build(&BusConfig::default(), 0.02).expect("the default bench is sound")
}

fn signal(name: &str, node: u32) -> SignalConfig {
    SignalConfig { node: Some(node), ..SignalConfig::new(name) }
}

/// Two VESCs, nodes 23 and 24, seven pole pairs.
fn vesc() -> BusConfig {
    let rate = |node| SignalConfig { pole_pairs: Some(7), ..signal("STATUS.erpm", node) };
    BusConfig {
        database: vec![DatabaseConfig { file: "vesc".to_owned(), node_mask: Some(0xFF) }],
        sensors: [
            (Channel::PropellerRate1, rate(23)),
            (Channel::PropellerRate2, rate(24)),
            (Channel::BatteryVoltage, signal("STATUS_5.input_voltage", 23)),
            (Channel::EscTemperature1, signal("STATUS_4.fet_temperature", 23)),
            (Channel::MotorTemperature1, signal("STATUS_4.motor_temperature", 23)),
            (Channel::EscTemperature2, signal("STATUS_4.fet_temperature", 24)),
            (Channel::MotorTemperature2, signal("STATUS_4.motor_temperature", 24)),
        ]
        .into(),
        commands: [
            (CommandField::Rotor1, signal("SET_DUTY.duty", 23)),
            (CommandField::Rotor2, signal("SET_DUTY.duty", 24)),
        ]
        .into(),
        messages: [].into(),
        ..BusConfig::default()
    }
}

fn sensors() -> Sensors {
    let mut sensors = Sensors::default();
    for (index, field) in Channel::ALL.into_iter().enumerate() {
        *field.of_mut(&mut sensors) = Sample::good(1.5 + index as f64, 1, 1);
    }
    sensors
}

#[test]
fn sensors_cross_from_the_emulator_to_the_bridge() {
    let roles = bench();
    let (mut sender, mut receiver) = (roles.sensor_sender(), roles.sensor_receiver());
    let (sent, mut received) = (sensors(), Sensors::default());
    let mut updated = 0;
    for index in 0..roles.sensor_messages().len() {
        let frame = roles.encode_sensors(&mut sender, index, &sent).expect("a message");
        updated |= roles.decode_sensors(&mut receiver, &frame, 77, &mut received).updated;
    }
    for field in BusConfig::default().sensors.into_keys() {
        let (sent, received) = (field.of(&sent), field.of(&received));
        // Half of the coarsest step of the profile, 0.05 rad/s.
        assert!((sent.value - received.value).abs() <= 0.025, "{field}: {received:?}");
        assert_eq!((received.stamp_ns, received.count, received.health), (77, 1, 0), "{field}");
        assert_ne!(updated & field.bit(), 0, "{field}");
    }
    assert_eq!(received.thrust[0].health, Health::NEVER, "a field without a role stays untouched");
    assert_eq!((receiver.counts.frames, receiver.counts.accepted), (4, 4));
}

/// A page of a multiplexed message: sent under its number, taken only from there.
#[test]
fn a_multiplexed_sensor_is_sent_on_its_page_and_taken_from_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("pages.dbc");
    let text = "VERSION \"\"\n\nBU_: IMU\n\nBO_ 100 PAGES: 8 IMU\n SG_ page M : 0|8@1+ (1,0) [0|255] \"\" IMU\n \
                SG_ rate m3 : 8|16@1- (0.01,0) [-100|100] \"rad/s\" IMU\n \
                SG_ heat m4 : 8|16@1- (0.01,0) [-100|100] \"degC\" IMU\n";
    std::fs::write(&file, text).expect("written");
    let mut config = BusConfig::default();
    config.database.push(DatabaseConfig { file: file.display().to_string(), node_mask: None });
    config.sensors = [(Channel::BodyRate, SignalConfig::new("PAGES.rate"))].into();
    config.messages.clear();
    let roles = Roles::build(&config, 0.02).expect("sound");
    let (mut sender, mut receiver) = (roles.sensor_sender(), roles.sensor_receiver());
    let sent = Sensors { body_rate: Sample::good(-1.25, 1, 1), ..Sensors::default() };
    let frame = roles.encode_sensors(&mut sender, 0, &sent).expect("the only message");
    assert_eq!(frame.data()[..3], [3, 0x83, 0xFF], "page 3, -125 steps of 0.01");
    let mut received = Sensors::default();
    let decoded = roles.decode_sensors(&mut receiver, &frame, 77, &mut received);
    assert_eq!((decoded.updated, received.body_rate.value), (Channel::BodyRate.bit(), -1.25));
    let other = Frame::classic(frame.id(), &[4, 1, 0, 0, 0, 0, 0, 0]).expect("fits");
    let decoded = roles.decode_sensors(&mut receiver, &other, 78, &mut received);
    assert_eq!((decoded.updated, decoded.refused), (0, None));
    assert_eq!((received.body_rate.value, received.body_rate.count), (-1.25, 1));
}

#[test]
fn commands_cross_from_the_bridge_to_the_emulator() {
    // The bench's frame carries both commands, a VESC's one each.
    for (config, each) in [(BusConfig::default(), vec![0b11]), (vesc(), vec![0b01, 0b10])] {
        let roles = Roles::build(&config, 0.02).expect("sound");
        let (mut sender, mut receiver) = (roles.command_sender(), roles.command_receiver());
        let mut commands = RotorCommands::default();
        for rotor in [[0.0, 0.0], [1.0, 0.5], [0.123, 0.987]] {
            let applied = Applied { rotor, state: 2, ..Applied::default() };
            let frames = roles.encode_commands(&mut sender, &applied);
            let decode = |frame| roles.decode_commands(&mut receiver, frame, 5, &mut commands).updated;
            assert_eq!(frames.iter().map(decode).collect::<Vec<_>>(), each);
            assert!(frames.iter().all(|frame| roles.is_command(frame)));
            for (got, sent) in commands.rotor.iter().zip(rotor) {
                // Half of the step of the bench profile, 0.00002.
                assert!((got - sent).abs() <= 1e-5, "{commands:?}");
            }
        }
        assert_eq!(commands.stamp_ns, [5, 5]);
        assert_eq!(receiver.counts.accepted, 3 * each.len() as u64);
        assert!(!roles.is_command(&gyro(0, 0.0)));
    }
}

#[test]
fn no_command_leaves_the_span_from_zero_to_one() {
    let roles = Roles::build(&vesc(), 0.02).expect("sound");
    let cases = [(f64::NAN, 0), (f64::INFINITY, 100_000), (f64::NEG_INFINITY, 0), (-0.3, 0), (1.7, 100_000)];
    for (value, duty) in cases {
        let applied = Applied { rotor: [value; 2], ..Applied::default() };
        let frames = roles.encode_commands(&mut roles.command_sender(), &applied);
        assert_eq!(frames.len(), 2);
        for (frame, node) in frames.iter().zip([23, 24]) {
            assert_eq!(frame.id(), Id::Extended(node), "SET_DUTY is command 0");
            assert_eq!(frame.data(), i32::to_be_bytes(duty), "{value}");
        }
    }
}

#[test]
fn a_vesc_speaks_in_electrical_revolutions_of_its_node() {
    let roles = Roles::build(&vesc(), 0.02).expect("sound");
    let (mut receiver, mut sensors) = (roles.sensor_receiver(), Sensors::default());
    let erpm = 7 * 6000_i32;
    let data = [&erpm.to_be_bytes()[..], &[0, 51, 1, 0xF4]].concat();
    for node in [23, 25] {
        let frame = Frame::classic(Id::Extended(0x900 | node), &data).expect("8 bytes");
        roles.decode_sensors(&mut receiver, &frame, 9, &mut sensors);
    }
    assert!((sensors.propeller_rate[0].value - 100.0 * TAU).abs() < 1e-9, "{:?}", sensors.propeller_rate);
    assert_eq!(sensors.propeller_rate[1].health, Health::NEVER);
    assert_eq!(receiver.counts.unknown_id, 1, "node 25 is nobody's");
}

/// 0.1 degree Celsius a step, big-endian and signed; without a sensor at the motor the VESC says something impossible.
#[test]
fn temperatures_of_a_vesc_are_in_kelvin_and_impossible_ones_are_refused() {
    let roles = Roles::build(&vesc(), 0.02).expect("sound");
    let (mut receiver, mut sensors) = (roles.sensor_receiver(), Sensors::default());
    let mut receive = |sensors: &mut Sensors, data: [u8; 8]| {
        let frame = Frame::classic(Id::Extended(0x1017), &data).expect("8 bytes");
        roles.decode_sensors(&mut receiver, &frame, 5, sensors)
    };
    let decoded = receive(&mut sensors, [0x01, 0xC5, 0xFF, 0xCE, 0, 0, 0, 0]);
    assert_eq!(decoded.updated, Channel::EscTemperature1.bit() | Channel::MotorTemperature1.bit());
    let kelvin = |sample: &Sample| (100.0 * sample.value).round() / 100.0;
    assert_eq!(kelvin(&sensors.esc_temperature[0]), 318.45, "45.3 degrees");
    assert_eq!(kelvin(&sensors.motor_temperature[0]), 268.15, "-5.0 degrees");
    receive(&mut sensors, [0x01, 0xC6, 0x80, 0x00, 0, 0, 0, 0]);
    assert_eq!(kelvin(&sensors.esc_temperature[0]), 318.55);
    assert_eq!(
        (kelvin(&sensors.motor_temperature[0]), sensors.motor_temperature[0].health),
        (268.15, Health::OUT_OF_RANGE)
    );
    assert_eq!(sensors.esc_temperature[1], Sample::never(), "node 24 was silent");
}

#[test]
fn the_current_command_of_the_vesc_documentation() {
    let mut config = vesc();
    config.commands.insert(
        CommandField::State,
        SignalConfig { unit: Some(String::new()), ..signal("SET_CURRENT.current", 23) },
    );
    let roles = Roles::build(&config, 0.02).expect("an explicit unit overrides the file's");
    let applied = Applied { state: 51, ..Applied::default() };
    let frames = roles.encode_commands(&mut roles.command_sender(), &applied);
    let frame = frames.iter().find(|frame| frame.id() == Id::Extended(0x117)).expect("sent");
    assert_eq!(frame.data(), [0x00, 0x00, 0xC7, 0x38], "51 A to node 23 is 117#0000C738");
}

/// A gyro frame of the bench profile.
fn gyro(counter: u8, rate: f32) -> Frame {
    let data = [&[counter, 20, 0, 0][..], &rate.to_le_bytes()].concat();
    Frame::classic(Id::Standard(0x20), &data).expect("8 bytes")
}

#[test]
fn a_bad_frame_moves_no_value_and_is_counted_by_cause() {
    let roles = bench();
    let (mut state, mut sensors) = (roles.sensor_receiver(), Sensors::default());
    roles.decode_sensors(&mut state, &gyro(1, 2.5), 10, &mut sensors);
    let short = Frame::classic(Id::Standard(0x20), &[0; 7]).expect("fits");
    let cases = [
        (gyro(2, f32::NAN), FrameRefusal::NotANumber, Health::NOT_A_NUMBER),
        (gyro(3, f32::INFINITY), FrameRefusal::NotANumber, Health::NOT_A_NUMBER),
        (gyro(4, 41.0), FrameRefusal::OutOfRange, Health::OUT_OF_RANGE),
        (gyro(4, 1.0), FrameRefusal::Counter, Health::COUNTER),
        (gyro(200, 1.0), FrameRefusal::Counter, Health::COUNTER),
        (short, FrameRefusal::WrongLength, 0),
        (Frame::classic(Id::Standard(0x21), &[0; 8]).expect("fits"), FrameRefusal::UnknownId, 0),
        (Frame::classic(Id::Extended(0x20), &[0; 8]).expect("fits"), FrameRefusal::UnknownId, 0),
        (Frame::remote(Id::Standard(0x20), 8).expect("fits"), FrameRefusal::UnknownId, 0),
        // Only we command the rotors; what somebody else sends with that identifier is no value, whatever its length.
        (Frame::classic(Id::Standard(0x10), &[0; 8]).expect("fits"), FrameRefusal::ForeignCommand, 0),
        (Frame::classic(Id::Standard(0x10), &[]).expect("fits"), FrameRefusal::ForeignCommand, 0),
        (Frame::remote(Id::Standard(0x10), 8).expect("fits"), FrameRefusal::UnknownId, 0),
    ];
    for (frame, refusal, health) in cases {
        let mut after = sensors;
        after.body_rate.health = 0;
        let decoded = roles.decode_sensors(&mut state, &frame, 99, &mut after);
        assert_eq!((decoded.updated, decoded.refused), (0, Some(refusal)), "{frame:?}");
        assert_eq!((after.body_rate.value, after.body_rate.stamp_ns), (2.5, 10), "{refusal}");
        assert_eq!(after.body_rate.health, health, "{refusal}");
    }
    let counts = state.counts;
    assert_eq!((counts.frames, counts.accepted), (13, 1));
    assert_eq!(counts.refused().map(|(_, count)| count), [4, 2, 1, 2, 2, 1], "{counts:?}");
    roles.decode_sensors(&mut state, &gyro(5, -1.0), 100, &mut sensors);
    assert_eq!((sensors.body_rate.value, sensors.body_rate.health), (-1.0, 0), "the next good one is good");
}

#[test]
fn a_counter_tells_lost_frames() {
    let roles = bench();
    let (mut state, mut sensors) = (roles.sensor_receiver(), Sensors::default());
    for counter in [254, 255, 0, 3, 4] {
        roles.decode_sensors(&mut state, &gyro(counter, 0.0), 1, &mut sensors);
    }
    assert_eq!((state.counts.accepted, state.counts.lost, state.counts.counter), (5, 2, 0));
}

#[test]
fn a_sensor_mounted_the_other_way_round_and_a_narrower_range() {
    let mut config = BusConfig::default();
    let role = config.sensors.get_mut(&Channel::BodyRate).expect("there");
    (role.factor, role.maximum) = (-1.0, Some(3.0));
    config.messages.insert("GYRO".to_owned(), MessageConfig::default());
    let roles = Roles::build(&config, 0.02).expect("sound");
    let (mut state, mut sensors) = (roles.sensor_receiver(), Sensors::default());
    for (rate, good) in [(2.0, true), (-2.0, true), (-3.5, false), (3.5, true)] {
        roles.decode_sensors(&mut state, &gyro(0, rate), 1, &mut sensors);
        assert_eq!(sensors.body_rate.is_good(), good, "{rate}");
        assert_eq!(sensors.body_rate.value == f64::from(-rate), good, "{rate}");
    }
}

#[test]
fn commands_go_first_on_the_bus_then_gyro_accelerometer_escs() {
    let roles = bench();
    let commands = roles.command_messages().iter().map(|route| route.name.as_str());
    let sensors = roles.sensor_messages().iter().map(|route| route.name.as_str());
    let order: Vec<&str> = commands.chain(sensors).collect();
    assert_eq!(order, ["COMMAND", "GYRO", "ACCELEROMETER", "ESC_1_STATUS", "ESC_2_STATUS"]);
    let ids: Vec<u32> = roles
        .command_messages()
        .iter()
        .map(|route| route.id.number())
        .chain(roles.sensor_messages().iter().map(|route| route.id.number()))
        .collect();
    assert!(ids.is_sorted(), "{ids:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: proptest::test_runner::RngSeed::Fixed(0xCA4), failure_persistence: None, ..ProptestConfig::with_cases(2_000) })]

    /// Whatever arrives, a value the roles pass on is finite, in range and stamped now; no other changes.
    #[test]
    fn nothing_on_the_bus_gets_a_bad_value_through(
        frames in prop::collection::vec((prop_oneof![0x1E_u32..0x44, 0_u32..0x800], prop::collection::vec(any::<u8>(), 0..=8)), 1..20)
    ) {
        let roles = bench();
        let (mut state, mut sensors) = (roles.sensor_receiver(), Sensors::default());
        for (stamp, (id, data)) in frames.iter().enumerate() {
            let frame = Frame::classic(Id::new(*id, false).expect("11 bits"), data).expect("fits");
            let before = sensors;
            let decoded = roles.decode_sensors(&mut state, &frame, stamp as u64 + 1, &mut sensors);
            for route in roles.sensor_messages() {
                for binding in route.bindings() {
                    let (old, new) = (binding.field.of(&before), binding.field.of(&sensors));
                    if decoded.updated & binding.field.bit() == 0 {
                        prop_assert_eq!((old.value, old.stamp_ns), (new.value, new.stamp_ns));
                    } else {
                        let (least, most) = binding.range;
                        prop_assert!(new.value >= least - 1e-6 && new.value <= most + 1e-6);
                        prop_assert_eq!((new.stamp_ns, new.health), (stamp as u64 + 1, 0));
                    }
                }
            }
        }
        let counts = state.counts;
        prop_assert_eq!(counts.frames, frames.len() as u64);
        let refused = counts.unknown_id + counts.wrong_length + counts.counter;
        prop_assert!(counts.accepted + refused <= counts.frames);
    }
}
