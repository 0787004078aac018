//! A bench on DroneCAN, as `check` shows it.

use crate::can::config::BusConfig;
use crate::can::frame::Id;
use crate::can::load::{BusLoad, MessageLoad, classic_bits, fd_bits};
use crate::can::protocol::{MessageDescription, SignalDescription};
use crate::clock::span_s;

use super::bus::DronecanBus;
use super::common::name;
use super::dsdl::{NumberKind, Primitive};
use super::node::{ARMING_EVERY_NS, STATUS_EVERY_NS};
use super::place::BitPlace;
use super::received::{Bound, Received, Sender};
use super::transfer::{Framing, TransferFrames, TransferHeader, priority};

/// How full the messages make the bus at worst; what each node says of itself once a second is left out.
pub(super) fn load(bus: &DronecanBus, config: &BusConfig) -> BusLoad {
    let bit_rate = f64::from(config.bit_rate.max(1));
    let data_ratio = bit_rate / f64::from(config.data_bit_rate.max(1));
    let messages: Vec<MessageLoad> = descriptions(bus)
        .into_iter()
        .map(|message| {
            let bits = match bus.framing {
                Framing::Classic => {
                    transfer_bits(message.bytes, bus.framing, &|id, length| classic_bits(id, length) as f64)
                }
                Framing::Fd => {
                    transfer_bits(message.bytes, bus.framing, &|id, length| fd_bits(id, length, data_ratio))
                }
            };
            let percent = 100.0 * bits / (bit_rate * message.period_s);
            MessageLoad { message: message.name, bits, percent }
        })
        .collect();
    let percent = messages.iter().map(|message| message.percent).sum();
    BusLoad { messages, percent }
}

/// [bit] of a transfer of so many bytes, all its frames at full stuffing, each of `frame_bits`.
fn transfer_bits(bytes: usize, framing: Framing, frame_bits: &dyn Fn(Id, usize) -> f64) -> f64 {
    let before = TransferFrames::count(bytes, framing) - 1;
    let last = framing.sent_bytes(bytes) - before * framing.frame_bytes();
    let id = Id::Extended(0);
    before as f64 * frame_bits(id, framing.frame_bytes() + 1) + frame_bits(id, last + 1)
}

/// The messages of the bench: what is sent, then what is received.
pub(super) fn descriptions(bus: &DronecanBus) -> Vec<MessageDescription> {
    let sent = |name: &str, priority, type_id, bytes, period_s, signals| MessageDescription {
        name: name.to_owned(),
        is_sent: true,
        id: Id::Extended(TransferHeader::message(priority, type_id, bus.node_id).id()),
        bytes,
        period_s,
        counter: None,
        may_have_counter: false,
        lacks_node: false,
        signals,
    };
    let command = &bus.command;
    let rotors = command.rotors.iter().enumerate().map(|(rotor, place)| SignalDescription {
        role: format!("commands.rotor_{}", rotor + 1),
        channel: None,
        name: format!("{}[{}]", command.field, bus.esc_index.get(rotor).copied().unwrap_or(0)),
        place: place_text(place, bus.framing),
        unit: command.unit.to_owned(),
        si_unit: "-",
        factor: 1.0 / command.full,
        offset: 0.0,
        range: (0.0, 1.0),
    });
    let common = &bus.common;
    let mut all = vec![
        sent(command.name, priority::HIGH, command.type_id, command.length, bus.period_s, rotors.collect()),
        sent(
            name::ARMING_STATUS,
            priority::MEDIUM,
            common.arming.type_id,
            1,
            span_s(ARMING_EVERY_NS),
            Vec::new(),
        ),
        sent(name::NODE_STATUS, priority::LOW, common.status.type_id, 7, span_s(STATUS_EVERY_NS), Vec::new()),
    ];
    for received in &bus.received {
        all.extend(
            received.senders().into_iter().map(|(sender, bounds)| describe(bus, received, sender, &bounds)),
        );
    }
    all
}

fn describe(
    bus: &DronecanBus,
    received: &Received,
    (node, esc): Sender,
    bounds: &[&Bound],
) -> MessageDescription {
    let who = [esc.map(|esc| format!("esc {esc}")), node.map(|node| format!("node {node}"))];
    let who = who.into_iter().flatten().collect::<Vec<_>>().join(", ");
    let name = &received.compound.name;
    let header = TransferHeader::message(priority::MEDIUM, received.type_id, node.unwrap_or(0));
    MessageDescription {
        name: if who.is_empty() { name.clone() } else { format!("{name} ({who})") },
        is_sent: false,
        // Not an anonymous one, though no node is named: the type keeps its place.
        id: Id::Extended(header.id() | u32::from(received.type_id) << 8),
        bytes: received.empty_payload(bus.framing).len(),
        period_s: received.period_s,
        counter: None,
        may_have_counter: false,
        lacks_node: false,
        signals: bounds.iter().map(|bound| signal(bound, bus.framing)).collect(),
    }
}

fn signal(bound: &Bound, framing: Framing) -> SignalDescription {
    SignalDescription {
        role: format!("sensors.{}", bound.channel),
        channel: Some(bound.channel),
        name: bound.path.clone(),
        place: place_text(&bound.place, framing),
        unit: bound.unit.clone(),
        si_unit: bound.channel.unit(),
        factor: bound.scale,
        offset: bound.offset,
        range: bound.range,
    }
}

fn place_text(place: &BitPlace, framing: Framing) -> String {
    let Primitive { kind, bits, .. } = place.primitive;
    let number = match kind {
        NumberKind::Boolean => "bool".to_owned(),
        NumberKind::Unsigned => format!("u{bits}"),
        NumberKind::Signed => format!("i{bits}"),
        NumberKind::Float => format!("f{bits}"),
    };
    format!("{number} at {}", place.end(framing) - bits as usize)
}
