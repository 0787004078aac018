//! The bridge as a node of the bus: sensors in, commands, arming and its own state out.

use crate::can::frame::{Frame, Id};
use crate::can::protocol::{BridgeEnd, ForeignSender, IdFilter, NodeTrouble};
use crate::can::roles::{Counts, Decoded, safe_command};
use crate::can::route::FrameRefusal;
use crate::signal::{Applied, Sensors};

use super::assembler::{Assembler, Transfer};
use super::bus::{Commanding, DronecanBus};
use super::node::{ARMING_EVERY_NS, AT_ONCE, Node};
use super::received::Received;
use super::transfer::{TransferFrames, TransferHeader, TransferId, priority};
use super::watch::NodeWatch;

/// Name that the bridge gives of itself.
const NAME: &str = "org.rotorbench.bridge";
/// Most frames of a command: 20 ESCs of 18 bits.
const MOST_COMMAND: usize = 7;
/// Most frames that are due at once: arming, state, and a part of an answer.
const MOST_DUE: usize = 2 + AT_ONCE;
/// Codes of the guard's states in which commands leave (`guard::State`).
const LIVE: [u32; 2] = [2, 3];
/// What `ArmingStatus` says.
const FULLY_ARMED: u8 = 255;

/// What a subscription is for.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    /// The received type of this place.
    Values(usize),
    NodeStatus,
    InfoRequest,
    /// Commands of somebody else: as our own, or of the other kind.
    Command {
        is_own_kind: bool,
    },
    /// Somebody else says whether rotors may turn: ours, too, as it names none.
    Arming,
}

/// The bridge's end of a bus on DroneCAN.
#[derive(Debug)]
pub(super) struct Bridge {
    bus: DronecanBus,
    assembler: Assembler,
    purposes: Vec<Purpose>,
    counts: Counts,
    watch: NodeWatch,
    node: Node,
    command_id: TransferId,
    arming_id: TransferId,
    /// What was said of arming last, and when [ns].
    armed: Option<(bool, u64)>,
    foreign: Option<ForeignSender>,
    command: [Frame; MOST_COMMAND],
    due: [Frame; MOST_DUE],
}

impl Bridge {
    pub fn new(bus: &DronecanBus) -> Self {
        let mut all: Vec<_> = bus
            .received
            .iter()
            .enumerate()
            .map(|(at, it)| (it.subscription(), Purpose::Values(at)))
            .collect();
        all.push((bus.common.status, Purpose::NodeStatus));
        all.push((bus.common.info_request(bus.node_id), Purpose::InfoRequest));
        all.push((bus.command.subscription, Purpose::Command { is_own_kind: true }));
        all.push((bus.other_command.subscription, Purpose::Command { is_own_kind: false }));
        all.push((bus.common.arming, Purpose::Arming));
        let (subscriptions, purposes) = all.into_iter().unzip();
        Self {
            assembler: Assembler::new(subscriptions),
            purposes,
            counts: Counts::default(),
            watch: NodeWatch::new(),
            node: Node::with_unique_id(&bus.common, bus.node_id, NAME, bus.unique_id).framed(bus.framing),
            command_id: TransferId::default(),
            arming_id: TransferId::default(),
            armed: None,
            foreign: None,
            command: [Frame::EMPTY; MOST_COMMAND],
            due: [Frame::EMPTY; MOST_DUE],
            bus: bus.clone(),
        }
    }

    fn refuse(&mut self, refusal: FrameRefusal) -> Decoded {
        self.counts.add(refusal);
        Decoded { updated: 0, refused: Some(refusal) }
    }
}

impl BridgeEnd for Bridge {
    fn own(&self) -> Vec<IdFilter> {
        // Whatever this node sends ends with its id.
        vec![IdFilter { id: Id::Extended(u32::from(self.bus.node_id)), bits: 0x7F }]
    }

    fn receive(&mut self, frame: &Frame, stamp_ns: u64, sensors: &mut Sensors) -> Decoded {
        self.counts.frames = self.counts.frames.wrapping_add(1);
        let Self { bus, assembler, purposes, counts, watch, node, foreign, .. } = self;
        let transfer = match assembler.receive(frame, stamp_ns) {
            Ok(Some(transfer)) => transfer,
            Ok(None) => return Decoded { updated: 0, refused: None },
            Err(refusal) => return self.refuse(refusal),
        };
        let source = transfer.header.source;
        // Nobody's number is that of many.
        if source == bus.node_id && source != 0 {
            watch.twice(source, stamp_ns);
        }
        let refused = match purposes.get(transfer.subscription).copied() {
            Some(Purpose::Values(at)) => {
                counts.lost = counts.lost.wrapping_add(transfer.lost);
                let received = bus.received.get(at);
                let decoded = received.map(|it| take(it, &transfer, watch, counts, sensors));
                return decoded.unwrap_or(Decoded { updated: 0, refused: None });
            }
            Some(Purpose::NodeStatus) => {
                watch.heard(&bus.common, &transfer);
                None
            }
            Some(Purpose::InfoRequest) => {
                node.ask(&transfer);
                None
            }
            Some(Purpose::Command { is_own_kind }) => {
                let command = if is_own_kind { &bus.command } else { &bus.other_command };
                // A command holds a number for each ESC from the first on, and so does ours: whoever commands any is in our way,
                // or we in his. There are no two benches that leave each other alone.
                command.last(&transfer).map(|last| {
                    let reaches_ours = bus.esc_index.iter().any(|index| *index <= last);
                    *foreign = Some(ForeignSender::Commands { node: source, last, reaches_ours });
                    FrameRefusal::ForeignCommand
                })
            }
            Some(Purpose::Arming) => (source != bus.node_id).then(|| {
                let status = transfer.payload.first().copied().unwrap_or(0);
                *foreign = Some(ForeignSender::Arms { node: source, status });
                FrameRefusal::ForeignCommand
            }),
            None => Some(FrameRefusal::UnknownId),
        };
        refused.map_or(Decoded { updated: 0, refused: None }, |refusal| self.refuse(refusal))
    }

    fn commands(&mut self, applied: &Applied) -> &[Frame] {
        if self.bus.node_id == 0 {
            return &[];
        }
        let framing = self.bus.framing;
        let Commanding { full, rotors, length, type_id, subscription, .. } = self.bus.command;
        let mut payload = [0; MOST_COMMAND * 8];
        for (place, rotor) in rotors.iter().zip(applied.rotor) {
            place.write(&mut payload, framing, safe_command(rotor) * full);
        }
        let header = TransferHeader::message(priority::HIGH, type_id, self.bus.node_id);
        let payload = payload.get(..length).unwrap_or(&[]);
        let frames =
            TransferFrames::new(header, subscription.seed, self.command_id.take(), payload).framed(framing);
        let mut count = 0;
        for (place, frame) in self.command.iter_mut().zip(frames) {
            *place = frame;
            count += 1;
        }
        self.command.get(..count).unwrap_or(&[])
    }

    fn due_frames(&mut self, now_ns: u64, applied: &Applied) -> &[Frame] {
        if self.bus.node_id == 0 {
            return &[];
        }
        let mut count = 0;
        let mut owe = |frame: Option<Frame>| {
            if let (Some(frame), Some(place)) = (frame, self.due.get_mut(count)) {
                *place = frame;
                count += 1;
            }
        };
        // As long as the rotors may turn: on the ramp to zero, too.
        let is_armed = LIVE.contains(&applied.state) || applied.rotor.iter().any(|rotor| *rotor > 0.0);
        let is_due = self.armed.is_none_or(|(said, said_ns)| {
            said != is_armed || now_ns.saturating_sub(said_ns) >= ARMING_EVERY_NS
        });
        if is_due {
            self.armed = Some((is_armed, now_ns));
            let arming = self.bus.common.arming;
            let header = TransferHeader::message(priority::MEDIUM, arming.type_id, self.bus.node_id);
            let payload = [if is_armed { FULLY_ARMED } else { 0 }];
            let frames = TransferFrames::new(header, arming.seed, self.arming_id.take(), &payload);
            owe(frames.framed(self.bus.framing).next());
        }
        owe(self.node.status(now_ns, applied.state));
        for _ in 0..AT_ONCE {
            owe(self.node.answer());
        }
        self.due.get(..count).unwrap_or(&[])
    }

    fn trouble(&self, now_ns: u64) -> Option<NodeTrouble> {
        self.watch.trouble(self.bus.node_id, now_ns)
    }

    fn foreign(&self) -> Option<ForeignSender> {
        self.foreign
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

/// Takes the good values of a transfer.
fn take(
    received: &Received,
    transfer: &Transfer<'_>,
    watch: &mut NodeWatch,
    counts: &mut Counts,
    sensors: &mut Sensors,
) -> Decoded {
    let (node, stamp_ns) = (transfer.header.source, transfer.stamp_ns);
    let mut decoded = Decoded { updated: 0, refused: None };
    for bound in received.bound.iter().filter(|bound| bound.is_meant(transfer)) {
        let channel = bound.channel;
        let read = if watch.is_believed(channel, node, stamp_ns) {
            bound.read(transfer)
        } else {
            Err(FrameRefusal::OtherNode)
        };
        let sample = channel.of_mut(sensors);
        match read {
            Ok(value) => {
                sample.count = sample.count.wrapping_add(1);
                (sample.value, sample.stamp_ns, sample.health) = (value, stamp_ns, 0);
                watch.gave(channel, node, stamp_ns);
                decoded.updated |= channel.bit();
            }
            Err(refusal) => {
                sample.count = sample.count.wrapping_add(1);
                sample.health |= refusal.health();
                counts.add(refusal);
                decoded.refused = Some(refusal);
            }
        }
    }
    counts.accepted = counts.accepted.wrapping_add(u64::from(decoded.updated != 0));
    decoded
}
