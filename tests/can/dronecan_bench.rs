//! A bench on DroneCAN, both ends of its bus in memory: roles, arming, what is answered and what is refused.

use rotorbench::can::dronecan::{
    CommandKind, CompoundBody, DsdlConfig, Framing, Library, Subscription, TransferFrames, TransferHeader,
    TransferKind, Value, decode, encode,
};
use rotorbench::can::{
    BenchEnd, BridgeEnd, BusConfig, CanError, Frame, ProtocolName, RotorCommands, SignalConfig, protocol,
};
use rotorbench::signal::{Applied, Channel, Sample, Sensor, Sensors};

pub const MS: u64 = 1_000_000;
pub const S: u64 = 1_000 * MS;
/// Guard's state codes.
pub const DISARMED: u32 = 0;
pub const ARMED: u32 = 2;
pub const FAILSAFE: u32 = 4;

pub fn config() -> BusConfig {
    BusConfig { protocol: ProtocolName::Dronecan, ..BusConfig::default() }
}

pub fn ends(config: &BusConfig) -> (Box<dyn BridgeEnd>, Box<dyn BenchEnd>) {
    let spoken = protocol(config, 0.02).expect("sound");
    (spoken.bridge_end(), spoken.bench_end(S))
}

pub fn applied(state: u32, rotor: [f64; 2]) -> Applied {
    Applied { state, rotor, ..Applied::default() }
}

pub fn measured(now_ns: u64) -> Sensors {
    let mut sensors = Sensors::default();
    for (index, channel) in Channel::ALL.into_iter().enumerate() {
        *channel.of_mut(&mut sensors) = Sample::good(10.0 + index as f64, now_ns, 1);
    }
    sensors.esc_temperature = [Sample::good(310.0, now_ns, 1), Sample::good(311.0, now_ns, 1)];
    sensors
}

/// What the bench sends at `now_ns`.
pub fn sent(bench: &mut dyn BenchEnd, now_ns: u64, sensors: &Sensors) -> Vec<Frame> {
    let mut frames = Vec::new();
    bench.send_due(now_ns, sensors, &mut |frame| frames.push(*frame));
    frames
}

/// A transfer of another node.
pub fn transfer(name: &str, kind: TransferKind, source: u8, transfer_id: u8, value: &Value) -> Vec<Frame> {
    let library = Library::build(&[]).expect("sound");
    let compound = library.get(name).expect("published");
    let structure = match (&compound.body, kind) {
        (CompoundBody::Message(message), _) => message,
        (CompoundBody::Service(request, _), TransferKind::Request { .. }) => request,
        (CompoundBody::Service(_, response), _) => response,
    };
    let type_id = compound.id.expect("sent");
    let subscription = Subscription::new(type_id, kind, compound.signature, structure.most_bits());
    let payload = encode(structure, value, Framing::Classic).expect("of this type");
    let header = TransferHeader { priority: 16, type_id, source, kind, discriminator: 0 };
    TransferFrames::new(header, subscription.seed, transfer_id, &payload).collect()
}

pub fn integers(values: &[i128]) -> Value {
    Value::List(values.iter().copied().map(Value::Integer).collect())
}

pub fn raw_command(source: u8, transfer_id: u8, values: &[i128]) -> Vec<Frame> {
    let value = Value::List(vec![integers(values)]);
    transfer("uavcan.equipment.esc.RawCommand", TransferKind::Message, source, transfer_id, &value)
}

/// Uptime, health, mode.
pub fn node_status(source: u8, transfer_id: u8, [uptime, health, mode]: [i128; 3]) -> Vec<Frame> {
    let value = integers(&[uptime, health, mode, 0, 0]);
    transfer("uavcan.protocol.NodeStatus", TransferKind::Message, source, transfer_id, &value)
}

/// What an IMU and two ESCs say.
const OF_IMU_AND_ESCS: [Sensor; 6] = [
    Sensor::BodyRate,
    Sensor::Acceleration,
    Sensor::BatteryVoltage,
    Sensor::PropellerRate,
    Sensor::Current,
    Sensor::EscTemperature,
];

#[test]
fn what_the_nodes_measure_reaches_the_bridge() {
    let spoken = protocol(&config(), 0.02).expect("sound");
    let signals = spoken.messages().into_iter().flat_map(|message| message.signals);
    let roles: Vec<Channel> = signals.filter_map(|signal| signal.channel).collect();
    let known = OF_IMU_AND_ESCS.iter().flat_map(|sensor| sensor.channels());
    known.for_each(|channel| assert!(roles.contains(channel), "{channel}"));
    let (mut bridge, mut bench) = ends(&config());
    let sent_values = measured(S);
    let mut sensors = Sensors::default();
    let mut updated = 0;
    for frame in sent(&mut *bench, S, &sent_values) {
        updated |= bridge.receive(&frame, S + MS, &mut sensors).updated;
    }
    for channel in Channel::ALL {
        let (sent_values, read) = (channel.of(&sent_values), channel.of(&sensors));
        let has_role = roles.contains(&channel);
        assert_eq!(updated & channel.bit() != 0, has_role, "{channel}");
        // Whole rpm, and eleven bits of a half float: both within a part in a thousand of these values.
        let error = (read.value - sent_values.value).abs();
        assert!(
            !has_role || read.is_good() && error <= 0.06_f64.max(1e-3 * sent_values.value),
            "{channel}: {read:?}"
        );
        assert!(!has_role || read.stamp_ns == S + MS, "{channel}");
    }
    let counts = bridge.counts();
    assert_eq!((counts.refused().map(|it| it.1), counts.lost), ([0; 6], 0), "{counts:?}");
    assert_eq!(counts.accepted, 3, "an IMU and two ESCs");
}

#[test]
fn commands_reach_the_rotors_in_both_messages() {
    let rpm = BusConfig {
        dronecan: rotorbench::can::dronecan::DronecanConfig {
            command: CommandKind::Rpm,
            rpm_maximum: Some(9000),
            esc_index: [7, 3],
            ..Default::default()
        },
        ..config()
    };
    for (config, grid) in [(config(), 0.5 / 8191.0), (rpm, 0.5 / 9000.0)] {
        let (mut bridge, mut bench) = ends(&config);
        for (step, rotor) in [[0.0, 0.0], [0.25, 0.75], [1.0, 0.1], [f64::NAN, 2.0]].into_iter().enumerate() {
            let frames = bridge.commands(&applied(ARMED, rotor)).to_vec();
            let mut commands = RotorCommands::default();
            let mut updated = 0;
            for frame in &frames {
                assert!(bench.is_command(frame));
                updated |= bench.receive(frame, S + step as u64, &mut commands).updated;
            }
            let wanted = rotor.map(|it: f64| if it.is_nan() { 0.0 } else { it.min(1.0) });
            assert_eq!(updated, 3);
            assert!(
                commands.rotor.iter().zip(wanted).all(|(a, b)| (a - b).abs() <= grid * 1.001),
                "{commands:?}"
            );
        }
    }
}

/// 255 while commands leave, and on the ramp; 0 in every other state.
#[test]
fn the_rotors_may_turn_while_the_guard_says_so_and_never_otherwise() {
    let (mut bridge, mut bench) = ends(&config());
    let mut commands = RotorCommands::default();
    let mut now_ns = S;
    assert!(!bench.may_turn(now_ns), "before anybody said so");
    for (state, rotor, may_turn) in [
        (DISARMED, 0.0, false),
        (1, 0.0, false),
        (ARMED, 0.0, true),
        (3, 0.4, true),
        (FAILSAFE, 0.2, true),
        (FAILSAFE, 0.0, false),
        (ARMED, 0.3, true),
        (5, 0.0, false),
    ] {
        for _ in 0..3 {
            now_ns += 20 * MS;
            for frame in bridge.due_frames(now_ns, &applied(state, [rotor, 0.0])).to_vec() {
                bench.receive(&frame, now_ns, &mut commands);
            }
            assert_eq!(bench.may_turn(now_ns), may_turn, "state {state}, {rotor}");
        }
    }
    // Said again and again, and believed no longer than that.
    let said = |bridge: &mut Box<dyn BridgeEnd>, from_ns: u64| {
        let id = |frame: &&Frame| frame.id().number() >> 8 & 0xFFFF == 1100;
        let turn = |turn: u64| from_ns + turn * 20 * MS;
        let each = (0..100)
            .map(|it| bridge.due_frames(turn(it), &applied(ARMED, [0.1; 2])).iter().filter(id).count());
        each.sum::<usize>()
    };
    assert_eq!(said(&mut bridge, now_ns), 4, "each half second");
    assert!(!bench.may_turn(now_ns + 3 * S));
}

#[test]
fn every_node_says_once_a_second_how_it_is() {
    let (mut bridge, mut bench) = ends(&config());
    let is_status =
        |frame: &&Frame| frame.id().number() >> 8 & 0xFFFF == 341 && frame.id().number() & 0x80 == 0;
    let (mut own, mut others) = (0, 0);
    for turn in 0..250 {
        let now_ns = S + turn * 20 * MS;
        own += bridge.due_frames(now_ns, &applied(DISARMED, [0.0; 2])).iter().filter(is_status).count();
        others += sent(&mut *bench, now_ns, &measured(now_ns)).iter().filter(is_status).count();
    }
    assert_eq!((own, others), (5, 15));
}

#[test]
fn who_asks_what_a_node_is_is_told_in_a_few_frames_a_period() {
    let (mut bridge, _) = ends(&config());
    let request = transfer(
        "uavcan.protocol.GetNodeInfo",
        TransferKind::Request { to: 100 },
        9,
        5,
        &Value::List(vec![]),
    );
    bridge.receive(&request[0], S, &mut Sensors::default());
    let mut answer = Vec::new();
    for turn in 0..20 {
        let due = bridge.due_frames(S + turn, &applied(DISARMED, [0.0; 2])).to_vec();
        assert!(due.len() <= 4);
        answer.extend(due.into_iter().filter(|frame| frame.id().number() & 0x80 != 0));
    }
    let library = Library::build(&[]).expect("sound");
    let compound = library.get("uavcan.protocol.GetNodeInfo").expect("published");
    let CompoundBody::Service(_, response) = &compound.body else { panic!("a service") };
    let subscription =
        Subscription::new(1, TransferKind::Response { to: 9 }, compound.signature, response.most_bits());
    let mut assembler = rotorbench::can::dronecan::Assembler::new(vec![subscription]);
    let mut whole = None;
    for frame in &answer {
        if let Some(transfer) = assembler.receive(frame, S).expect("sound") {
            assert_eq!((transfer.header.source, transfer.transfer_id), (100, 5));
            whole = Some(decode(response, transfer.payload, transfer.framing).expect("an answer"));
        }
    }
    let Some(Value::List(fields)) = whole else { panic!("no answer") };
    let name: Vec<Value> =
        b"org.rotorbench.bridge".iter().map(|it| Value::Integer(i128::from(*it))).collect();
    assert_eq!(fields[3], Value::List(name));
}

/// A vendor's message, its ESCs told apart by their node ids.
#[test]
fn a_file_of_dsdl_makes_signals_of_a_vendor_s_message() {
    let root = env!("CARGO_MANIFEST_DIR");
    let mut own = config();
    own.dronecan.dsdl = vec![DsdlConfig {
        file: format!("{root}/tests/can/dsdl/com/hobbywing/esc/20050.StatusMsg1.uavcan"),
        namespace: "com.hobbywing.esc".to_owned(),
    }];
    for (channel, node) in [(Channel::PropellerRate1, 8), (Channel::PropellerRate2, 9)] {
        let mut role = SignalConfig::new("com.hobbywing.esc.StatusMsg1.rpm");
        (role.node, role.unit) = (Some(node), Some("rpm".to_owned()));
        own.sensors.insert(channel, role);
    }
    own.sensors.retain(|channel, _| channel.name().starts_with("propeller"));
    let spoken = protocol(&own, 0.02).expect("sound");
    let names: Vec<String> = spoken.messages().into_iter().map(|it| it.name).collect();
    assert!(names.contains(&"com.hobbywing.esc.StatusMsg1 (node 9)".to_owned()), "{names:?}");
    let (mut bridge, mut bench) = (spoken.bridge_end(), spoken.bench_end(S));
    let mut sensors = Sensors::default();
    let mut sent_values = measured(S);
    sent_values.propeller_rate = [Sample::good(700.0, S, 1), Sample::good(800.0, S, 1)];
    for frame in sent(&mut *bench, S, &sent_values) {
        bridge.receive(&frame, S, &mut sensors);
    }
    let rates = sensors.propeller_rate.map(|it| it.value.round());
    assert_eq!(rates, [700.0, 800.0]);
    own.dronecan.dsdl[0].file = "nowhere/1.X.uavcan".to_owned();
    let Err(CanError::Read { file, .. }) = protocol(&own, 0.02) else { panic!("there is no such file") };
    assert_eq!(file, "nowhere/1.X.uavcan");
}

/// Only own frames are heard for echoes: those whose identifier ends with the bridge's number.
#[test]
fn whatever_the_bridge_sends_is_its_own() {
    let (mut bridge, _) = ends(&config());
    let own = bridge.own();
    let is_own = |frame: &Frame| {
        own.iter().any(|it| (frame.id().number() ^ it.id.number()) & it.bits == 0 && frame.id().is_extended())
    };
    let request = transfer(
        "uavcan.protocol.GetNodeInfo",
        TransferKind::Request { to: 100 },
        9,
        5,
        &Value::List(vec![]),
    );
    assert!(!is_own(&request[0]));
    bridge.receive(&request[0], S, &mut Sensors::default());
    let mut frames = bridge.commands(&applied(ARMED, [0.1; 2])).to_vec();
    frames.extend_from_slice(bridge.due_frames(S, &applied(ARMED, [0.1; 2])));
    assert!(frames.len() >= 4 && frames.iter().all(is_own), "{frames:?}");
}
