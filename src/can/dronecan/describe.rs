//! A bench on DroneCAN, as `check` shows it.

use crate::can::config::BusConfig;
use crate::can::frame::Id;
use crate::can::load::BusLoad;
use crate::can::protocol::{BenchEnd, BridgeEnd, MessageDescription, Protocol, SignalDescription};

use super::bench::Bench;
use super::bridge::Bridge;
use super::bus::{Bound, DronecanBus, Received};
use super::common::name;
use super::dsdl::{Kind, Primitive};
use super::node::{ARMING_EVERY_NS, STATUS_EVERY_NS};
use super::place::Place;
use super::transfer::{Header, priority};
use crate::clock::span_s;

impl Protocol for DronecanBus {
    fn bridge_end(&self) -> Box<dyn BridgeEnd> {
        Box::new(Bridge::new(self))
    }

    fn bench_end(&self, now_ns: u64) -> Box<dyn BenchEnd> {
        Box::new(Bench::new(self, now_ns))
    }

    fn messages(&self) -> Vec<MessageDescription> {
        self.descriptions()
    }

    fn load(&self, config: &BusConfig) -> BusLoad {
        self.load_of(config)
    }
}

/// Who sends a message: its node, as far as one is named, and the ESC whose it is.
type Sender = (Option<u8>, Option<u8>);

impl Received {
    /// The senders of this type, each with the numbers that are read of its messages.
    pub(super) fn senders(&self) -> Vec<(Sender, Vec<&Bound>)> {
        let mut senders: Vec<(Sender, Vec<&Bound>)> = Vec::new();
        for bound in &self.bound {
            let sender = (bound.node, bound.esc.map(|(_, index)| index));
            match senders.iter_mut().find(|(known, _)| *known == sender) {
                Some((_, bounds)) => bounds.push(bound),
                None => senders.push((sender, vec![bound])),
            }
        }
        senders
    }
}

impl DronecanBus {
    /// The messages of the bench: what is sent, then what is received.
    pub(super) fn descriptions(&self) -> Vec<MessageDescription> {
        let sent = |name: &str, priority, type_id, bytes, period_s, signals| MessageDescription {
            name: name.to_owned(),
            is_sent: true,
            id: Id::Extended(Header::message(priority, type_id, self.node_id).id()),
            bytes,
            period_s,
            counter: None,
            may_have_counter: false,
            lacks_node: false,
            signals,
        };
        let command = &self.command;
        let rotors = command.rotors.iter().enumerate().map(|(rotor, place)| SignalDescription {
            role: format!("commands.rotor_{}", rotor + 1),
            channel: None,
            name: format!("{}[{}]", command.field, self.esc_index.get(rotor).copied().unwrap_or(0)),
            place: place_text(place),
            unit: command.unit.to_owned(),
            si_unit: "-",
            factor: 1.0 / command.full,
            offset: 0.0,
            range: (0.0, 1.0),
        });
        let common = &self.common;
        let mut all = vec![
            sent(
                command.name,
                priority::HIGH,
                command.type_id,
                command.length,
                self.period_s,
                rotors.collect(),
            ),
            sent(
                name::ARMING_STATUS,
                priority::MEDIUM,
                common.arming.type_id,
                1,
                span_s(ARMING_EVERY_NS),
                Vec::new(),
            ),
            sent(
                name::NODE_STATUS,
                priority::LOW,
                common.status.type_id,
                7,
                span_s(STATUS_EVERY_NS),
                Vec::new(),
            ),
        ];
        for received in &self.received {
            all.extend(
                received.senders().into_iter().map(|(sender, bounds)| describe(received, sender, &bounds)),
            );
        }
        all
    }
}

fn describe(received: &Received, (node, esc): Sender, bounds: &[&Bound]) -> MessageDescription {
    let who = [esc.map(|esc| format!("esc {esc}")), node.map(|node| format!("node {node}"))];
    let who = who.into_iter().flatten().collect::<Vec<_>>().join(", ");
    let name = &received.compound.name;
    let header = Header::message(priority::MEDIUM, received.type_id, node.unwrap_or(0));
    MessageDescription {
        name: if who.is_empty() { name.clone() } else { format!("{name} ({who})") },
        is_sent: false,
        // Not an anonymous one, though no node is named: the type keeps its place.
        id: Id::Extended(header.id() | u32::from(received.type_id) << 8),
        bytes: received.usual_bytes(),
        period_s: received.period_s,
        counter: None,
        may_have_counter: false,
        lacks_node: false,
        signals: bounds.iter().map(|bound| signal(bound)).collect(),
    }
}

fn signal(bound: &Bound) -> SignalDescription {
    SignalDescription {
        role: format!("sensors.{}", bound.channel),
        channel: Some(bound.channel),
        name: bound.path.clone(),
        place: place_text(&bound.place),
        unit: bound.unit.clone(),
        si_unit: bound.channel.unit(),
        factor: bound.scale,
        offset: bound.offset,
        range: bound.range,
    }
}

fn place_text(place: &Place) -> String {
    let Primitive { kind, bits, .. } = place.primitive;
    let number = match kind {
        Kind::Boolean => "bool".to_owned(),
        Kind::Unsigned => format!("u{bits}"),
        Kind::Signed => format!("i{bits}"),
        Kind::Float => format!("f{bits}"),
    };
    format!("{number} at {}", place.at)
}
