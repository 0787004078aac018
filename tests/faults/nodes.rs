//! The bench on DroneCAN: each ESC and the IMU a node, and what a node, or the way of its frames, does wrong.

use rotorbench::can::dronecan::{NodeId, TransferHeader, TransferKind};
use rotorbench::can::{BenchEnd, BusConfig, Frame, Id, Protocol, ProtocolName, RotorCommands, protocol};
use rotorbench::signal::Sensors;

/// [s] of a run: a node is silent for three of them before it is missed.
pub const FLIGHT_S: f64 = 7.0;
/// Node ids of the bridge; of the second ESC and of the IMU, where the bench file names none; of somebody else, and of who gives
/// node ids.
const BRIDGE: u8 = 100;
const ESC_2: u8 = 21;
const IMU: u8 = 50;
const OTHER: u8 = 9;
const ALLOCATOR: u8 = 127;
/// Data type ids.
const STATUS: u16 = 341;
const ESC_STATUS: u16 = 1034;
const ARMING: u16 = 1100;

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeFault {
    Nothing,
    /// All nodes begin anew at once: uptimes and numbers of transfers, too.
    Restarts,
    /// The checksum of each transfer of the second ESC.
    Checksum,
    /// The toggle bit within each transfer of the IMU.
    Toggle,
    /// Another node says how it is under the second ESC's number.
    Twice,
    /// Another node says how it is under the bridge's number.
    OwnTwice,
    /// Who gave the bridge its number says no longer how it is.
    AllocatorDies,
    /// The second ESC says no longer how it is.
    Silent,
    /// The second ESC says that it fails.
    Unwell,
    /// The ESCs report ten times a second.
    Slow,
    /// What the bridge says of arming reaches nobody.
    ArmingLost,
    /// Somebody else says that no rotor may turn.
    Disarmed,
}

/// The protocol of the bench. On a bus in memory there is room for everything at 1 kHz, too.
pub fn spoken(period_s: f64, fault: NodeFault) -> Box<dyn Protocol> {
    let mut bus =
        BusConfig { protocol: ProtocolName::Dronecan, bit_rate: 10_000_000, ..BusConfig::default() };
    let was_given = fault == NodeFault::AllocatorDies;
    bus.dronecan.node_id = if was_given { NodeId::Allocated(BRIDGE) } else { NodeId::Fixed(BRIDGE) };
    protocol(&bus, period_s).expect("the built-in types")
}

/// The nodes.
pub struct Nodes<'a> {
    spoken: &'a dyn Protocol,
    fault: NodeFault,
    /// First slot of the fault, and slots of 0.1 s.
    from: u64,
    tenth: u64,
    end: Box<dyn BenchEnd>,
    /// The one with a number that another has.
    twin: Option<Box<dyn BenchEnd>>,
}

impl<'a> Nodes<'a> {
    pub fn new(spoken: &'a dyn Protocol, fault: NodeFault, from: u64, period_ns: u64, now_ns: u64) -> Self {
        let tenth = (100_000_000 / period_ns).max(1);
        Self { spoken, fault, from, tenth, end: spoken.bench_end(now_ns), twin: None }
    }

    /// What they send in this slot, as it reaches the bridge.
    pub fn measure(&mut self, slot: u64, now_ns: u64, sensors: &Sensors) -> Vec<Frame> {
        if slot == self.from && self.fault == NodeFault::Restarts {
            self.end = self.spoken.bench_end(now_ns);
        }
        // Half a second after the one whose number it has, so that their states alternate.
        if slot == self.from + 5 * self.tenth && self.fault == NodeFault::Twice {
            self.twin = Some(self.spoken.bench_end(now_ns));
        }
        let mut frames = Vec::new();
        self.end.send_due(now_ns, sensors, &mut |frame| frames.push(*frame));
        let is_own =
            |frame: &Frame| header(frame).is_some_and(|it| (it.source, it.type_id) == (ESC_2, STATUS));
        if let Some(twin) = &mut self.twin {
            let mut other = Vec::new();
            twin.send_due(now_ns, sensors, &mut |frame| other.push(*frame));
            frames.extend(other.into_iter().filter(is_own));
        }
        let is_second = slot.is_multiple_of(10 * self.tenth);
        if self.fault == NodeFault::AllocatorDies && slot < self.from && is_second {
            frames.push(well(ALLOCATOR, slot / (10 * self.tenth)));
        }
        if slot < self.from {
            return frames;
        }
        if self.fault == NodeFault::OwnTwice && (slot - self.from).is_multiple_of(10 * self.tenth) {
            frames.push(well(BRIDGE, (slot - self.from) / (10 * self.tenth)));
        }
        if self.fault == NodeFault::Disarmed && (slot - self.from).is_multiple_of(5 * self.tenth) {
            frames.push(disarmed(slot));
        }
        frames.into_iter().filter_map(|frame| self.spoil(slot, frame)).collect()
    }

    /// A frame as it arrives, if it does.
    fn spoil(&self, slot: u64, frame: Frame) -> Option<Frame> {
        let TransferHeader { type_id, source, .. } = header(&frame)?;
        let (tail, is_first) = (frame.data().last()?, frame.data().last()? & 0x80 != 0);
        let is_long = tail & 0xC0 != 0xC0;
        match self.fault {
            NodeFault::Checksum if source == ESC_2 && is_long && is_first => {
                Some(changed(&frame, |data| data[0] ^= 1))
            }
            NodeFault::Toggle if source == IMU && is_long && !is_first => Some(changed(&frame, |data| {
                let last = data.len() - 1;
                data[last] ^= 0x20;
            })),
            NodeFault::Silent if (source, type_id) == (ESC_2, STATUS) => None,
            // Health in the two highest bits of its byte: 2 is an error.
            NodeFault::Unwell if (source, type_id) == (ESC_2, STATUS) => {
                Some(changed(&frame, |data| data[4] = 0x80))
            }
            NodeFault::Slow if type_id == ESC_STATUS && !(slot - self.from).is_multiple_of(self.tenth) => {
                None
            }
            _ => Some(frame),
        }
    }

    /// What the bridge sent reaches the ESCs: which rotors have a new command.
    pub fn obey(&mut self, slot: u64, now_ns: u64, frame: &Frame, commands: &mut RotorCommands) -> u32 {
        let is_arming = header(frame).is_some_and(|it| it.type_id == ARMING);
        if is_arming && self.fault == NodeFault::ArmingLost && slot >= self.from {
            return 0;
        }
        self.end.receive(frame, now_ns, commands).updated
    }

    /// What somebody else says to the ESCs in this slot.
    pub fn said_to_escs(&self, slot: u64) -> Option<Frame> {
        let says = self.fault == NodeFault::Disarmed
            && slot >= self.from
            && (slot - self.from).is_multiple_of(5 * self.tenth);
        says.then(|| disarmed(slot))
    }

    /// Whether the ESCs let their rotors turn.
    pub fn may_turn(&self, now_ns: u64) -> bool {
        self.end.may_turn(now_ns)
    }
}

fn header(frame: &Frame) -> Option<TransferHeader> {
    match frame.id() {
        Id::Extended(id) => Some(TransferHeader::parse(id)).filter(|it| it.kind == TransferKind::Message),
        Id::Standard(_) => None,
    }
}

/// `ArmingStatus` 0 of another node; each a transfer of its own.
fn disarmed(slot: u64) -> Frame {
    let id = Id::Extended(TransferHeader::message(16, ARMING, OTHER).id());
    Frame::classic(id, &[0, 0xC0 | (slot % 31) as u8]).expect("short")
}

/// `NodeStatus` of a node that is well and this old [s].
fn well(node: u8, age_s: u64) -> Frame {
    let id = Id::Extended(TransferHeader::message(24, STATUS, node).id());
    let mut data = [0; 8];
    data[..4].copy_from_slice(&(age_s as u32).to_le_bytes());
    data[7] = 0xC0 | (age_s % 32) as u8;
    Frame::classic(id, &data).expect("short")
}

fn changed(frame: &Frame, change: impl FnOnce(&mut [u8])) -> Frame {
    let mut data = frame.data().to_vec();
    change(&mut data);
    Frame::new(frame.id(), frame.kind(), &data).expect("as long as before")
}
