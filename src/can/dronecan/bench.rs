//! The nodes that an emulator plays: ESCs that obey when they are armed, an IMU, a battery, each with an id of its own.

use crate::can::frame::Frame;
use crate::can::protocol::BenchEnd;
use crate::can::roles::{Counts, Decoded, RotorCommands};
use crate::can::route::FrameRefusal;
use crate::can::thresholds::THRESHOLDS;
use crate::clock;
use crate::signal::{Channel, Sensors};

use super::asking::Asking;
use super::assembler::{Assembler, Subscription, Transfer};
use super::bus::DronecanBus;
use super::join::emulated_unique_id;
use super::node::Node;
use super::place::BitPlace;
use super::store::{MOST_ANSWER, Store};
use super::transfer::{GREATEST_NODE, TransferFrames, TransferHeader, TransferId, priority};

/// Node ids of the emulated ESCs, by index, and of everything else, where the bench file names none.
const FIRST_ESC: u8 = 20;
const FIRST_OTHER: u8 = 50;
/// What the emulated nodes call themselves.
const NAME: &str = "org.rotorbench.emulated";

/// A message that an emulated node sends.
#[derive(Debug)]
struct Sent {
    /// Place of its node.
    node: usize,
    priority: u8,
    subscription: Subscription,
    transfer_id: TransferId,
    /// What nobody sets, and room for the rest.
    payload: Vec<u8>,
    /// Number = (SI value - offset) / scale.
    numbers: Vec<(Channel, BitPlace, f64, f64)>,
    period_ns: u64,
    due_ns: u64,
}

/// What a subscription is for.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    Command,
    Arming,
    InfoRequest { node: usize },
    Parameter { node: usize },
    Opcode { node: usize },
}

/// The bench's end of a bus on DroneCAN.
#[derive(Debug)]
pub(super) struct DronecanBenchEnd {
    bus: DronecanBus,
    assembler: Assembler,
    purposes: Vec<Purpose>,
    counts: Counts,
    nodes: Vec<Node>,
    /// Parameters of each node; those of an ESC have some.
    stores: Vec<Option<Store>>,
    messages: Vec<Sent>,
    /// Whether the rotors may turn, as it was heard last, and when [ns].
    armed: (bool, u64),
    /// The nodes that have no id yet.
    asking: Asking,
}

impl DronecanBenchEnd {
    pub fn new(bus: &DronecanBus, now_ns: u64) -> Self {
        let (mut nodes, mut messages): (Vec<Node>, Vec<Sent>) = (Vec::new(), Vec::new());
        let mut stores: Vec<Option<Store>> = Vec::new();
        for (at, received) in bus.received.iter().enumerate() {
            for ((node, esc), bounds) in received.senders() {
                let id = node.unwrap_or_else(|| free_id(bus, at, esc));
                let place = nodes.iter().position(|known| known.id == id).unwrap_or_else(|| {
                    let unique_id = emulated_unique_id(bus.unique_id, id);
                    let node = Node::with_unique_id(&bus.common, id, NAME, unique_id);
                    nodes.push(node.framed(bus.framing));
                    stores.push(esc.map(Store::of_esc));
                    nodes.len() - 1
                });
                let mut payload = received.empty_payload(bus.framing);
                if let Some((index, esc)) = bounds.first().and_then(|bound| bound.esc) {
                    index.write(&mut payload, bus.framing, f64::from(esc));
                }
                let period_ns = clock::span_ns(received.period_s).max(50_000);
                messages.push(Sent {
                    node: place,
                    priority: priority::MEDIUM,
                    subscription: received.subscription(),
                    transfer_id: TransferId::default(),
                    payload,
                    numbers: bounds.iter().map(|it| (it.channel, it.place, it.scale, it.offset)).collect(),
                    period_ns,
                    due_ns: now_ns,
                });
            }
        }
        let (subscriptions, purposes) = listened_to(bus, &nodes, &stores).into_iter().unzip();
        Self {
            assembler: Assembler::new(subscriptions),
            purposes,
            counts: Counts::default(),
            nodes,
            stores,
            messages,
            armed: (false, 0),
            asking: Asking::default(),
            bus: bus.clone(),
        }
    }

    /// The same with nodes that have no ids and ask for them; each wishes for the one that it would have by itself.
    pub fn asking(bus: &DronecanBus, now_ns: u64) -> Self {
        let mut bench = Self::new(bus, now_ns);
        let wishes: Vec<u8> = bench.nodes.iter_mut().map(|node| std::mem::take(&mut node.id)).collect();
        let asks = wishes
            .into_iter()
            .enumerate()
            .map(|(place, id)| (place, emulated_unique_id(bus.unique_id, id), id));
        bench.asking = Asking::new(bus.common.allocation, asks);
        bench
    }

    /// A node has got its id: from now on it speaks, and hears what it is asked.
    fn begin(&mut self, place: usize, id: u8) {
        let Some(node) = self.nodes.get_mut(place) else { return };
        node.id = id;
        let (subscriptions, purposes) = listened_to(&self.bus, &self.nodes, &self.stores).into_iter().unzip();
        (self.assembler, self.purposes) = (Assembler::new(subscriptions), purposes);
    }

    fn refuse(&mut self, refusal: FrameRefusal) -> Decoded {
        self.counts.add(refusal);
        Decoded { updated: 0, refused: Some(refusal) }
    }
}

/// What the emulated nodes listen to, and what for.
fn listened_to(bus: &DronecanBus, nodes: &[Node], stores: &[Option<Store>]) -> Vec<(Subscription, Purpose)> {
    let common = &bus.common;
    let mut all = vec![(bus.command.subscription, Purpose::Command), (common.arming, Purpose::Arming)];
    for (node, (it, store)) in nodes.iter().zip(stores).enumerate().filter(|(_, (it, _))| it.id != 0) {
        all.push((common.info_request(it.id), Purpose::InfoRequest { node }));
        if store.is_some() {
            all.push((common.get_set.requests_to(it.id), Purpose::Parameter { node }));
            all.push((common.execute_opcode.requests_to(it.id), Purpose::Opcode { node }));
        }
    }
    all
}

/// Has an emulated node answer who asks for one of its parameters, or what to do with them.
fn answer(bus: &DronecanBus, node: &mut Node, store: &mut Store, transfer: &Transfer<'_>, is_opcode: bool) {
    let mut answer = [0; MOST_ANSWER];
    let (service, length) = if is_opcode {
        (&bus.common.execute_opcode, store.execute(transfer.payload, &mut answer))
    } else {
        (&bus.common.get_set, store.get_set(transfer.payload, transfer.framing, &mut answer))
    };
    if let Some(payload) = length.and_then(|length| answer.get(..length)) {
        node.respond(service, transfer, payload);
    }
}

/// An id for an emulated node that the bench file does not name.
fn free_id(bus: &DronecanBus, received: usize, esc: Option<u8>) -> u8 {
    let id = match esc {
        Some(index) => FIRST_ESC + index,
        None => FIRST_OTHER + u8::try_from(received).unwrap_or(0) % FIRST_ESC,
    };
    if id == bus.node_id { GREATEST_NODE - 2 } else { id }
}

/// Takes in a transfer that commands the rotors.
#[inline]
fn take_command(
    bus: &DronecanBus,
    counts: &mut Counts,
    transfer: &Transfer<'_>,
    stamp_ns: u64,
    commands: &mut RotorCommands,
) -> Decoded {
    counts.lost = counts.lost.wrapping_add(transfer.lost);
    let mut decoded = Decoded { updated: 0, refused: None };
    for (rotor, place) in bus.command.rotors.iter().enumerate() {
        // A command that is too short is for others.
        let Some(number) = place.read(transfer.payload, transfer.framing) else { continue };
        let value = number / bus.command.full;
        if !(0.0..=1.0).contains(&value) {
            counts.add(FrameRefusal::OutOfRange);
            decoded.refused = Some(FrameRefusal::OutOfRange);
            continue;
        }
        if let (Some(to), Some(stamp)) = (commands.rotor.get_mut(rotor), commands.stamp_ns.get_mut(rotor)) {
            (*to, *stamp) = (value, stamp_ns);
            decoded.updated |= 1 << rotor;
        }
    }
    counts.accepted = counts.accepted.wrapping_add(u64::from(decoded.updated != 0));
    decoded
}

impl BenchEnd for DronecanBenchEnd {
    fn is_command(&self, frame: &Frame) -> bool {
        let purpose = self.assembler.find(frame).and_then(|(at, _)| self.purposes.get(at));
        matches!(purpose, Some(Purpose::Command))
    }

    fn receive(&mut self, frame: &Frame, stamp_ns: u64, commands: &mut RotorCommands) -> Decoded {
        self.counts.frames = self.counts.frames.wrapping_add(1);
        if let Some((place, id)) = self.asking.receive(frame, stamp_ns) {
            self.begin(place, id);
        }
        let nothing = Decoded { updated: 0, refused: None };
        let Self { bus, assembler, purposes, counts, nodes, stores, armed, .. } = self;
        let transfer = match assembler.receive(frame, stamp_ns) {
            Ok(Some(transfer)) => transfer,
            Ok(None) => return nothing,
            Err(refusal) => return self.refuse(refusal),
        };
        match purposes.get(transfer.subscription) {
            Some(Purpose::Command) => take_command(bus, counts, &transfer, stamp_ns, commands),
            Some(Purpose::Arming) => {
                *armed = (transfer.payload == [255], stamp_ns);
                nothing
            }
            Some(Purpose::InfoRequest { node }) => {
                if let Some(node) = nodes.get_mut(*node) {
                    node.ask(&transfer);
                }
                nothing
            }
            Some(Purpose::Parameter { node } | Purpose::Opcode { node }) => {
                let is_opcode = matches!(purposes.get(transfer.subscription), Some(Purpose::Opcode { .. }));
                if let (Some(it), Some(Some(store))) = (nodes.get_mut(*node), stores.get_mut(*node)) {
                    answer(bus, it, store, &transfer, is_opcode);
                }
                nothing
            }
            None => nothing,
        }
    }

    fn may_turn(&self, now_ns: u64) -> bool {
        let (is_armed, heard_ns) = self.armed;
        is_armed && now_ns.saturating_sub(heard_ns) <= THRESHOLDS.armed_for_ns
    }

    fn due_ns(&self) -> u64 {
        let messages = self.messages.iter().map(|message| message.due_ns);
        messages.chain(self.nodes.iter().map(Node::due_ns)).min().unwrap_or(u64::MAX)
    }

    fn send_due(&mut self, now_ns: u64, sensors: &Sensors, send: &mut dyn FnMut(&Frame)) -> bool {
        let Self { messages, nodes, asking, bus, .. } = self;
        let mut any = false;
        asking.due_frames(now_ns).iter().for_each(&mut *send);
        for message in messages.iter_mut().filter(|message| message.due_ns <= now_ns) {
            // Messages missed while the machine slept are not sent in a burst.
            let missed = (now_ns - message.due_ns) / message.period_ns;
            message.due_ns = message.due_ns.saturating_add(message.period_ns.saturating_mul(missed + 1));
            if !message.numbers.iter().any(|(channel, ..)| channel.of(sensors).stamp_ns > 0) {
                continue;
            }
            let known = message.numbers.iter().filter(|(channel, ..)| channel.of(sensors).stamp_ns > 0);
            for (channel, place, scale, offset) in known {
                place.write(&mut message.payload, bus.framing, (channel.of(sensors).value - offset) / scale);
            }
            let Some(node) = nodes.get(message.node).filter(|node| node.id != 0) else { continue };
            let header = TransferHeader::message(message.priority, message.subscription.type_id, node.id);
            let transfer_id = message.transfer_id.take();
            TransferFrames::new(header, message.subscription.seed, transfer_id, &message.payload)
                .framed(bus.framing)
                .for_each(|frame| send(&frame));
            any = true;
        }
        for node in nodes {
            node.status(now_ns, 0).iter().for_each(&mut *send);
            while let Some(frame) = node.answer() {
                send(&frame);
            }
        }
        any
    }

    fn without_id(&self) -> usize {
        self.asking.count()
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}
