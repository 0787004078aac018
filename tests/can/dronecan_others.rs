//! Other nodes on a bench's DroneCAN: who commands, is silent, unwell or there twice, and what a monitor hears of each.

use rotorbench::can::dronecan::{
    Library, NodeId, NodeMonitor, Participant, TransferHeader, TransferKind, Value, empty_message,
};
use rotorbench::can::{BenchEnd, BridgeEnd, ForeignSender, Frame, FrameRefusal, NodeTrouble, RotorCommands};
use rotorbench::signal::Sensors;

use super::dronecan_bench::{
    ARMED, DISARMED, FAILSAFE, MS, S, applied, config, ends, integers, measured, node_status, raw_command,
    sent, transfer,
};

#[test]
fn another_node_that_commands_any_esc_or_says_whether_they_may_turn_is_foreign() {
    let mut own = config();
    own.dronecan.esc_index = [2, 3];
    let (mut bridge, _) = ends(&own);
    let mut sensors = Sensors::default();
    assert_eq!(bridge.foreign(), None);
    for (transfer_id, values, last, reaches_ours) in
        [(10, &[100, 100][..], 1, false), (11, &[0, 0, 5], 2, true), (12, &[0; 20], 19, true)]
    {
        for frame in raw_command(9, transfer_id, values) {
            bridge.receive(&frame, S, &mut sensors);
        }
        assert_eq!(bridge.foreign(), Some(ForeignSender::Commands { node: 9, last, reaches_ours }));
    }
    let before = bridge.counts().foreign_command;
    let mut last = |frames: Vec<Frame>| {
        frames.iter().fold(None, |_, frame| bridge.receive(frame, S, &mut sensors).refused)
    };
    assert_eq!(last(raw_command(9, 0, &[])), None, "nobody is commanded");
    // Our commands hold zeros for these two.
    assert_eq!(last(raw_command(9, 3, &[100, 100])), Some(FrameRefusal::ForeignCommand));
    assert_eq!(last(raw_command(9, 4, &[0])), Some(FrameRefusal::ForeignCommand));
    assert_eq!(last(raw_command(9, 1, &[100, 100, 0])), Some(FrameRefusal::ForeignCommand));
    assert_eq!(last(raw_command(9, 2, &[0; 20])), Some(FrameRefusal::ForeignCommand), "in six frames");
    let rpm = Value::List(vec![integers(&[500; 4])]);
    let rpm = transfer("uavcan.equipment.esc.RPMCommand", TransferKind::Message, 9, 0, &rpm);
    assert_eq!(last(rpm), Some(FrameRefusal::ForeignCommand));
    for (transfer_id, status) in [(0, 0), (1, 255)] {
        let status = Value::List(vec![Value::Integer(status)]);
        let arming = |source, id| {
            transfer("uavcan.equipment.safety.ArmingStatus", TransferKind::Message, source, id, &status)
        };
        assert_eq!(last(arming(9, transfer_id)), Some(FrameRefusal::ForeignCommand));
        // With our own number it is found as a second node with that.
        assert_eq!(last(arming(100, transfer_id)), None);
    }
    assert_eq!(bridge.counts().foreign_command - before, 7);
    assert_eq!(bridge.foreign(), Some(ForeignSender::Arms { node: 9, status: 255 }));
}

/// Two benches on one bus: a command names every ESC from the first on, and arming names none. Neither takes the other for a bench
/// beside which it may be armed.
#[test]
fn two_benches_on_one_bus_are_foreign_to_each_other_whatever_their_indices() {
    let bench = |node: u8, esc_index: [u8; 2]| {
        let mut config = config();
        config.dronecan.node_id = NodeId::Fixed(node);
        config.dronecan.esc_index = esc_index;
        ends(&config).0
    };
    for state in [DISARMED, ARMED, FAILSAFE] {
        let mut benches = [bench(100, [0, 1]), bench(101, [2, 3])];
        for from in [0, 1] {
            let own = applied(state, [0.0; 2]);
            for frames in [benches[from].commands(&own).to_vec(), benches[from].due_frames(S, &own).to_vec()]
            {
                let heard = &mut benches[1 - from];
                let mut sensors = Sensors::default();
                let refused = frames.iter().filter_map(|frame| heard.receive(frame, S, &mut sensors).refused);
                assert!(
                    refused.collect::<Vec<_>>().contains(&FrameRefusal::ForeignCommand),
                    "{state}, {from}"
                );
            }
        }
    }
}

/// Gives the bridge what node 20 and its fellows measure, and `status` of each node that is said to be there.
fn turn(bridge: &mut dyn BridgeEnd, bench: &mut dyn BenchEnd, now_ns: u64, without_status_of: Option<u8>) {
    let mut sensors = Sensors::default();
    for frame in sent(bench, now_ns, &measured(now_ns)) {
        let header = TransferHeader::parse(frame.id().number());
        if header.type_id != 341 || Some(header.source) != without_status_of {
            bridge.receive(&frame, now_ns, &mut sensors);
        }
    }
}

#[test]
fn a_node_that_is_silent_or_unwell_is_trouble() {
    let (mut bridge, mut bench) = ends(&config());
    for at in 0..50 {
        turn(&mut *bridge, &mut *bench, S + at * 100 * MS, None);
        assert_eq!(bridge.trouble(S + at * 100 * MS), None);
    }
    let from_ns = 6 * S;
    let silent = (0..50).map(|at| {
        turn(&mut *bridge, &mut *bench, from_ns + at * 100 * MS, Some(21));
        bridge.trouble(from_ns + at * 100 * MS)
    });
    let silent: Vec<_> = silent.collect();
    let first = silent.iter().position(Option::is_some).expect("found");
    assert_eq!(silent[first], Some(NodeTrouble::Silent { node: 21 }));
    // Its last one was in the last second before.
    assert!((20..=31).contains(&first), "after {first} tenths of a second");

    let (mut bridge, mut bench) = ends(&config());
    turn(&mut *bridge, &mut *bench, S, None);
    let mut say = |source, state, transfer_id, now_ns| {
        let frame = node_status(source, transfer_id, state)[0];
        bridge.receive(&frame, now_ns, &mut Sensors::default());
        bridge.trouble(now_ns)
    };
    let unwell = Some(NodeTrouble::Unhealthy { node: 20 });
    assert_eq!(say(20, [1, 1, 0], 9, S + 1), None, "a warning is none");
    assert_eq!(say(20, [2, 2, 0], 10, S + 2), unwell);
    assert_eq!(say(20, [3, 0, 0], 11, S + 3), None);
    assert_eq!(say(20, [4, 0, 7], 12, S + 4), unwell, "about to leave");
    assert_eq!(say(20, [5, 0, 0], 13, S + 5), None);
    assert_eq!(say(77, [1, 3, 7], 0, S + 6), None, "nothing of it is used");
}

#[test]
fn two_nodes_with_one_number_are_found_and_a_restart_is_none() {
    let (mut bridge, mut bench) = ends(&config());
    turn(&mut *bridge, &mut *bench, S, None);
    let mut say = |uptime: i128, transfer_id: u8, now_ns: u64| {
        bridge.receive(&node_status(20, transfer_id, [uptime, 0, 0])[0], now_ns, &mut Sensors::default());
        bridge.trouble(now_ns)
    };
    assert_eq!(say(500, 1, S + 500 * MS), None);
    assert_eq!(say(0, 0, S + 1000 * MS), None, "it began anew");
    assert_eq!(say(501, 2, S + 1500 * MS), None);
    assert_eq!(say(1, 1, S + 2000 * MS), Some(NodeTrouble::Twice { node: 20 }));
    // Somebody with our own number.
    let (mut bridge, _) = ends(&config());
    bridge.receive(&node_status(100, 0, [1, 0, 0])[0], S, &mut Sensors::default());
    assert_eq!(bridge.trouble(S), Some(NodeTrouble::Twice { node: 100 }));
}

#[test]
fn of_two_that_measure_the_same_the_first_is_believed_until_it_is_silent() {
    let (mut bridge, _) = ends(&config());
    let library = Library::build(&[]).expect("sound");
    let imu = library.get("uavcan.equipment.ahrs.RawIMU").and_then(|it| it.message()).expect("published");
    let Value::List(mut fields) = empty_message(imu, 0.0) else { panic!("a structure") };
    let mut say = |source: u8, transfer_id: u8, rate: f64, now_ns: u64| {
        fields[2] = Value::List(vec![Value::Float(0.0), Value::Float(0.0), Value::Float(rate)]);
        let value = Value::List(fields.clone());
        let frames =
            transfer("uavcan.equipment.ahrs.RawIMU", TransferKind::Message, source, transfer_id, &value);
        let mut sensors = Sensors::default();
        let each = |_, frame| bridge.receive(frame, now_ns, &mut sensors).refused;
        let refused = frames.iter().fold(None, each);
        (refused, sensors.body_rate.value)
    };
    assert_eq!(say(40, 0, 1.0, S), (None, 1.0));
    assert_eq!(say(41, 0, 2.0, S + MS), (Some(FrameRefusal::OtherNode), 0.0));
    assert_eq!(say(40, 1, 3.0, S + 2 * MS), (None, 3.0));
    assert_eq!(say(41, 1, 4.0, 5 * S), (None, 4.0), "the first one is silent");
}

/// Each node is asked what it is until it has answered, and one that is only heard is there, too.
#[test]
fn a_monitor_hears_every_node_and_what_it_is() {
    let (mut bridge, mut bench) = ends(&config());
    let mut monitor = NodeMonitor::new(127).expect("a number");
    let (mut sensors, mut commands) = (Sensors::default(), RotorCommands::default());
    monitor.receive(&node_status(77, 0, [9, 1, 2])[0], S);
    for turn in 0..200 {
        let now_ns = S + turn * 20 * MS;
        let mut frames = sent(&mut *bench, now_ns, &measured(now_ns));
        frames.extend_from_slice(bridge.due_frames(now_ns, &applied(ARMED, [0.0; 2])));
        frames.iter().for_each(|frame| monitor.receive(frame, now_ns));
        for frame in monitor.due_frames(now_ns) {
            bridge.receive(&frame, now_ns, &mut sensors);
            bench.receive(&frame, now_ns, &mut commands);
        }
    }
    let nodes = monitor.nodes();
    let seen: Vec<_> = nodes.iter().map(|it| (it.id, it.info.as_ref().map(|it| it.name.as_str()))).collect();
    let emulated = Some("org.rotorbench.emulated");
    let bridge = Some("org.rotorbench.bridge");
    assert_eq!(seen, [(20, emulated), (21, emulated), (50, emulated), (77, None), (100, bridge)]);
    let (unknown, own) = (&nodes[3], &nodes[4]);
    assert_eq!((unknown.health, unknown.mode, unknown.uptime_s), (1, 2, 9));
    assert_eq!((own.health, own.code, own.uptime_s), (0, 2, 3), "its code is the guard's state");
    let version = (env!("CARGO_PKG_VERSION_MAJOR").parse(), env!("CARGO_PKG_VERSION_MINOR").parse());
    let software = own.info.as_ref().map(|it| it.software).expect("it answered");
    assert_eq!((Ok(software.0), Ok(software.1)), version);
    assert!(NodeMonitor::new(0).is_err() && NodeMonitor::new(128).is_err());
}
