//! Dynamic node ids: nodes without one and the allocator, over a bus in memory that loses, doubles and delays frames.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rotorbench::can::dronecan::{
    Allocatee, AllocationEvent, AllocationTable, DronecanConfig, Keep, NodeId, NodeIdAllocator, NodeMonitor,
    Participant, TransferKind, UniqueId, Value,
};
use rotorbench::can::{BusConfig, Frame, Id, ProtocolName, protocol};
use rotorbench::signal::{Applied, Sensors};

use super::dronecan_bench::{integers, transfer};

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;
const ALLOCATION: &str = "uavcan.protocol.dynamic_node_id.Allocation";

fn unique(first: u8, last: u8) -> UniqueId {
    let mut id = UniqueId([7; 16]);
    (id.0[0], id.0[15]) = (first, last);
    id
}

fn allocator<'a>(range: (u8, u8), table: AllocationTable, keep: Keep<'a>) -> NodeIdAllocator<'a> {
    NodeIdAllocator::new(NodeMonitor::new(127).expect("a number"), range, table, keep).expect("ids")
}

fn keeps<'a>() -> Keep<'a> {
    Box::new(|_| Ok(()))
}

/// What becomes of a frame on its way to one who listens.
#[derive(Debug, Clone, Copy)]
struct Way {
    is_lost: bool,
    is_doubled: bool,
    late_ms: u64,
}

const GOOD: Way = Way { is_lost: false, is_doubled: false, late_ms: 0 };

/// Lets all of them talk for so long; everybody hears everybody else.
fn talk(
    allocator: &mut NodeIdAllocator<'_>,
    nodes: &mut [Allocatee],
    seconds: u64,
    way: &mut dyn FnMut() -> Way,
) {
    let mut under_way: Vec<(u64, usize, Frame)> = Vec::new();
    for turn in 1..=seconds * 200 {
        let now_ns = S + turn * 5 * MS;
        let mut sent = Vec::new();
        for frame in allocator.due_frames(now_ns) {
            sent.push((usize::MAX, frame));
        }
        for (index, node) in nodes.iter_mut().enumerate() {
            sent.extend(node.due_frames(now_ns).into_iter().map(|frame| (index, frame)));
        }
        for (from, frame) in sent {
            for to in (0..nodes.len()).chain([usize::MAX]).filter(|to| *to != from) {
                let Way { is_lost, is_doubled, late_ms } = way();
                let copies = usize::from(!is_lost) + usize::from(is_doubled);
                under_way.extend(std::iter::repeat_n((now_ns + late_ms * MS, to, frame), copies));
            }
        }
        let due: Vec<_> = under_way.extract_if(.., |(at_ns, ..)| *at_ns <= now_ns).collect();
        for (_, to, frame) in due {
            match nodes.get_mut(to) {
                Some(node) => node.receive(&frame, now_ns),
                None => allocator.receive(&frame, now_ns),
            }
        }
    }
}

fn given(allocator: &mut NodeIdAllocator<'_>) -> Vec<(UniqueId, u8, bool)> {
    let mut given = Vec::new();
    while let Some(event) = allocator.take_event() {
        match event {
            AllocationEvent::Given { unique_id, node_id, is_new } => given.push((unique_id, node_id, is_new)),
            other => panic!("{other:?}"),
        }
    }
    given
}

#[test]
fn a_node_gets_the_highest_free_id_and_the_same_again() {
    let mut gives = allocator((100, 125), AllocationTable::new(), keeps());
    let mut nodes = [Allocatee::new(unique(1, 1), 0).expect("sound")];
    talk(&mut gives, &mut nodes, 4, &mut || GOOD);
    assert_eq!(nodes[0].given(), Some((125, 127)));
    assert_eq!(given(&mut gives), [(unique(1, 1), 125, true)]);
    // It began anew; another one comes, and one that wishes.
    let mut nodes = [(1, 0), (2, 0), (3, 110), (4, 110), (5, 20)]
        .map(|(first, wished)| Allocatee::new(unique(first, 1), wished).expect("sound"));
    talk(&mut gives, &mut nodes, 30, &mut || GOOD);
    let ids = nodes.each_ref().map(|node| node.given().map_or(0, |it| it.0));
    assert_eq!((ids[0], ids[1]), (125, 124));
    let wished: BTreeSet<u8> = ids[2..4].iter().copied().collect();
    assert_eq!((wished, ids[4]), ([110, 111].into(), 100), "below the range: its lowest");
    assert!(given(&mut gives).contains(&(unique(1, 1), 125, false)));
}

#[test]
fn an_id_that_is_heard_or_remembered_is_not_given_and_none_is_left_in_the_end() {
    let table: AllocationTable = [(unique(9, 9), 102)].into();
    let mut gives = allocator((100, 102), table, keeps());
    // Node 101 is there, by hand.
    let status = |id| {
        transfer("uavcan.protocol.NodeStatus", TransferKind::Message, 101, id, &integers(&[1, 0, 0, 0, 0]))
    };
    gives.receive(&status(0)[0], S);
    let mut nodes = [1, 2].map(|first| Allocatee::new(unique(first, 1), 0).expect("sound"));
    talk(&mut gives, &mut nodes, 15, &mut || GOOD);
    let ids: BTreeSet<Option<u8>> = nodes.iter().map(|node| node.given().map(|it| it.0)).collect();
    assert_eq!(ids, [None, Some(100)].into());
    let mut last = None;
    while let Some(event) = gives.take_event() {
        last = Some(event);
    }
    assert!(matches!(last, Some(AllocationEvent::NoneLeft { .. })), "{last:?}");
}

/// A remembered id of which somebody else says that it is his is not given again.
#[test]
fn an_id_that_another_node_has_by_now_is_not_given_again() {
    let mut gives = allocator((100, 125), [(unique(1, 1), 125)].into(), keeps());
    let status =
        transfer("uavcan.protocol.NodeStatus", TransferKind::Message, 125, 0, &integers(&[1, 0, 0, 0, 0]));
    gives.receive(&status[0], S);
    let info = Value::List(vec![
        integers(&[1, 0, 0, 0, 0]),
        integers(&[1, 0, 0, 0, 0]),
        Value::List(vec![Value::Integer(1), Value::Integer(0), integers(&[5; 16]), integers(&[])]),
        integers(&[110]),
    ]);
    gives.due_frames(S + 1);
    for frame in transfer("uavcan.protocol.GetNodeInfo", TransferKind::Response { to: 127 }, 125, 0, &info) {
        gives.receive(&frame, S + 2);
    }
    let mut nodes = [Allocatee::new(unique(1, 1), 0).expect("sound")];
    talk(&mut gives, &mut nodes, 4, &mut || GOOD);
    assert_eq!(nodes[0].given(), Some((124, 127)));
    assert_eq!(gives.table().get(&unique(1, 1)), Some(&124));
}

#[test]
fn what_cannot_be_remembered_is_not_given() {
    let tried = RefCell::new(0);
    let keep: Keep<'_> = Box::new(|_| {
        *tried.borrow_mut() += 1;
        if *tried.borrow() < 3 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(()) }
    });
    let mut gives = allocator((100, 125), AllocationTable::new(), keep);
    let mut nodes = [Allocatee::new(unique(1, 1), 0).expect("sound")];
    talk(&mut gives, &mut nodes, 2, &mut || GOOD);
    assert!(nodes[0].given().is_none() && gives.table().is_empty());
    assert!(matches!(gives.take_event(), Some(AllocationEvent::NotKept { .. })));
    talk(&mut gives, &mut nodes, 10, &mut || GOOD);
    assert_eq!(nodes[0].given(), Some((125, 127)), "once there is room");
}

#[test]
fn where_another_allocator_is_nothing_is_given() {
    let mut gives = allocator((100, 125), AllocationTable::new(), keeps());
    let other = Value::List(vec![Value::Integer(0), Value::Integer(0), integers(&[1, 2, 3, 4, 5, 6])]);
    for frame in transfer(ALLOCATION, TransferKind::Message, 126, 0, &other) {
        gives.receive(&frame, S);
    }
    assert!(matches!(gives.take_event(), Some(AllocationEvent::NotAlone { node: 126 })));
    let mut nodes = [Allocatee::new(unique(1, 1), 0).expect("sound")];
    talk(&mut gives, &mut nodes, 5, &mut || GOOD);
    assert!(nodes[0].given().is_none() && gives.take_event().is_none());
    for range in [(0, 5), (5, 128), (6, 5)] {
        let call = NodeMonitor::new(127).expect("a number");
        assert!(NodeIdAllocator::new(call, range, AllocationTable::new(), keeps()).is_err(), "{range:?}");
    }
}

/// Before it has a number, a bench says nothing, and whatever comes makes no trouble of it.
#[test]
fn a_bench_without_a_number_is_silent() {
    let dronecan = DronecanConfig { node_id: NodeId::Dynamic, ..DronecanConfig::default() };
    let config = BusConfig { protocol: ProtocolName::Dronecan, dronecan, ..BusConfig::default() };
    let mut bridge = protocol(&config, 0.02).expect("sound").bridge_end();
    let applied = Applied { state: 2, rotor: [0.5; 2], ..Applied::default() };
    for turn in 0..200 {
        let now_ns = S + turn * 20 * MS;
        let anonymous = Frame::classic(Id::Extended(0x1800_0100), &[1, 2, 3, 0xC0]).expect("short");
        bridge.receive(&anonymous, now_ns, &mut Sensors::default());
        assert!(bridge.commands(&applied).is_empty() && bridge.due_frames(now_ns, &applied).is_empty());
        assert_eq!(bridge.trouble(now_ns), None);
    }
    let mut given = config;
    given.dronecan.node_id = NodeId::Allocated(77);
    let mut bridge = protocol(&given, 0.02).expect("sound").bridge_end();
    let frames = bridge.commands(&applied);
    assert!(!frames.is_empty() && frames.iter().all(|frame| frame.id().number() & 0x7F == 77));
}

#[test]
fn a_node_id_is_a_number_or_dynamic() {
    let read = |text: &str| toml::from_str::<DronecanConfig>(text);
    assert_eq!(read("node_id = 7").expect("a number").node_id, NodeId::Fixed(7));
    let dynamic = read("node_id = \"dynamic\"").expect("the word");
    assert_eq!(dynamic.node_id, NodeId::Dynamic);
    // What was given stays with this run.
    let given = DronecanConfig { node_id: NodeId::Allocated(9), ..DronecanConfig::default() };
    for config in [dynamic, given, DronecanConfig::default()] {
        let text = toml::to_string(&config).expect("TOML");
        let wanted = if config.node_id == NodeId::Fixed(100) { NodeId::Fixed(100) } else { NodeId::Dynamic };
        assert_eq!(read(&text).expect("as written").node_id, wanted, "{text}");
    }
    for text in ["node_id = \"any\"", "node_id = 300", "node_id = 1.5", "node_id = -1"] {
        let error = read(text).expect_err(text).to_string();
        assert!(error.contains("a node id of 1 to 127 or \"dynamic\" is expected"), "{error}");
    }
}

fn fixed(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(0xA110),
        failure_persistence: None,
        ..ProptestConfig::with_cases(cases)
    }
}

fn way() -> impl Strategy<Value = Way> {
    (prop::bool::weighted(0.1), prop::bool::weighted(0.1), prop_oneof![4 => Just(0_u64), 1 => 0_u64..40])
        .prop_map(|(is_lost, is_doubled, late_ms)| Way { is_lost, is_doubled, late_ms })
}

proptest! {
    #![proptest_config(fixed(48))]

    /// Whatever becomes of the frames, no two nodes get one id, and what a node got is what the allocator remembers. When the bus
    /// is good again, everybody gets one.
    #[test]
    fn no_two_nodes_ever_get_one_id(
        ways in prop::collection::vec(way(), 997),
        // Nodes whose unique ids begin with the same bytes, and others.
        nodes in prop::collection::btree_set((0_u8..3, 0_u8..4), 1..6),
    ) {
        let mut gives = allocator((100, 125), AllocationTable::new(), keeps());
        let mut nodes: Vec<(UniqueId, Allocatee)> = nodes
            .into_iter()
            .map(|(first, last)| unique(first, last))
            .map(|id| (id, Allocatee::new(id, 0).expect("sound")))
            .collect();
        let (ids, mut talkers): (Vec<UniqueId>, Vec<Allocatee>) = nodes.drain(..).unzip();
        let mut ways = ways.into_iter().cycle();
        let check = |gives: &NodeIdAllocator<'_>, talkers: &[Allocatee]| {
            let given: Vec<u8> = talkers.iter().filter_map(|it| it.given()).map(|it| it.0).collect();
            let different: BTreeSet<u8> = given.iter().copied().collect();
            assert_eq!(given.len(), different.len());
            for (id, talker) in ids.iter().zip(talkers) {
                if let Some((node_id, _)) = talker.given() {
                    assert_eq!(gives.table().get(id), Some(&node_id));
                }
            }
            given.len()
        };
        talk(&mut gives, &mut talkers, 15, &mut || ways.next().expect("without end"));
        check(&gives, &talkers);
        let mut talkers_again = talkers;
        talk(&mut gives, &mut talkers_again, 60, &mut || GOOD);
        prop_assert_eq!(check(&gives, &talkers_again), ids.len());
    }

    /// Any frames: no panic, and no id outside the range.
    #[test]
    fn an_allocator_takes_or_refuses_any_frame(
        frames in prop::collection::vec((any::<u8>(), prop::collection::vec(any::<u8>(), 0..8), 0_u8..8), 1..200)
    ) {
        let mut gives = allocator((100, 101), AllocationTable::new(), keeps());
        let mut asks = Allocatee::new(unique(1, 1), 0).expect("sound");
        for (index, (source, data, tail)) in frames.into_iter().enumerate() {
            let bytes: Vec<u8> = data.into_iter().chain([tail << 5 | index as u8 & 1]).collect();
            let source = if source < 200 { 0 } else { u32::from(source) & 0x7F };
            let id = Id::Extended(0x1800_0100 | (index as u32 & 0xFF) << 10 | source);
            let frame = Frame::classic(id, &bytes).expect("short");
            let now_ns = S + index as u64 * 20 * MS;
            gives.receive(&frame, now_ns);
            asks.receive(&frame, now_ns);
            gives.due_frames(now_ns);
            asks.due_frames(now_ns);
        }
        prop_assert!(gives.table().values().all(|id| (100..=101).contains(id)));
    }
}
