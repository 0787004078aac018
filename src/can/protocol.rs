//! What a bus protocol is for the rest of the program: both ends of the bus, and what `check` says of it. No loop above this room
//! knows which protocol a bench speaks; by name it is known to those that play a built-in bench or ask the nodes of DroneCAN.
//!
//! An end is built once and then works frame by frame, without allocating, in a time that no frame can stretch.

use std::fmt;

use crate::signal::{Applied, Channel, Sensors};

use super::config::BusConfig;
use super::frame::{Frame, Id};
use super::load::BusLoad;
use super::roles::{Counts, Decoded, RotorCommands};

/// A protocol with the roles of a bench.
pub trait Protocol: fmt::Debug {
    /// The bridge's end: it takes in what sensors say and sends what the guard lets through.
    fn bridge_end(&self) -> Box<dyn BridgeEnd>;

    /// The other end, which an emulator plays: it takes commands and sends what sensors say, from `now_ns` on.
    fn bench_end(&self, now_ns: u64) -> Box<dyn BenchEnd>;

    /// The same end, played by nodes that have no ids yet and ask for them; `None` where nodes are given none.
    fn bench_end_without_ids(&self, _now_ns: u64) -> Option<Box<dyn BenchEnd>> {
        None
    }

    /// Both ends for frames of a capture, which may keep less to the letter than a bus must.
    fn capture_ends(&self) -> (Box<dyn BridgeEnd>, Box<dyn BenchEnd>) {
        (self.bridge_end(), self.bench_end(0))
    }

    /// The messages of the bench: what is sent, then what is received.
    fn messages(&self) -> Vec<MessageDescription>;

    /// How full they make the bus at worst; a message has the place that it has in [`Protocol::messages`].
    fn load(&self, config: &BusConfig) -> BusLoad;
}

/// The bridge's end of the bus.
pub trait BridgeEnd: fmt::Debug + Send {
    /// Which frames are this end's own, by their identifiers: their echoes are listened for apart from everything else.
    fn own(&self) -> Vec<IdFilter>;

    /// Takes the good values of a received frame into `sensors`, marks the bad ones there, and counts what it refuses.
    /// `stamp_ns` is CLOCK_MONOTONIC at reception. The frame is another sender's, so that one which commands the
    /// rotors is [`super::FrameRefusal::ForeignCommand`].
    fn receive(&mut self, frame: &Frame, stamp_ns: u64, sensors: &mut Sensors) -> Decoded;

    /// The frames that carry what the guard let through, a period's.
    fn commands(&mut self, applied: &Applied) -> &[Frame];

    /// What is due on the bus beside the commands, asked for once a period after they are out at `now_ns`; a few frames.
    fn due_frames(&mut self, _now_ns: u64, _applied: &Applied) -> &[Frame] {
        &[]
    }

    /// What is wrong at `now_ns` with a node that the bench needs.
    fn trouble(&self, _now_ns: u64) -> Option<NodeTrouble> {
        None
    }

    /// The last one of somebody else who commands the rotors, where the protocol says more of it than that.
    fn foreign(&self) -> Option<ForeignSender> {
        None
    }

    /// What became of the frames.
    fn counts(&self) -> Counts;
}

/// The end of the bus that an emulator plays.
pub trait BenchEnd: fmt::Debug + Send {
    /// Whether a frame is one of a command.
    fn is_command(&self, frame: &Frame) -> bool;

    /// Takes the good values of a command into `commands` and counts what it refuses.
    fn receive(&mut self, frame: &Frame, stamp_ns: u64, commands: &mut RotorCommands) -> Decoded;

    /// Whether the rotors obey at `now_ns`: some ESCs stand still until a message lets them turn.
    fn may_turn(&self, _now_ns: u64) -> bool {
        true
    }

    /// Nodes that have no id yet, and are silent until an allocator gives them one.
    fn without_id(&self) -> usize {
        0
    }

    /// [ns] when something is to be sent at the latest.
    fn due_ns(&self) -> u64;

    /// Sends what is due at `now_ns`; whether a sensor's message was.
    fn send_due(&mut self, now_ns: u64, sensors: &Sensors, send: &mut dyn FnMut(&Frame)) -> bool;

    /// What became of the frames.
    fn counts(&self) -> Counts;
}

/// What can be wrong with a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeTrouble {
    /// It gives values, and does not say how it is.
    Silent {
        /// Its number.
        node: u8,
    },
    /// It says that it is not well, or not at work.
    Unhealthy {
        /// Its number.
        node: u8,
    },
    /// Two nodes have its number.
    Twice {
        /// It.
        node: u8,
    },
}

/// Somebody else who commands the rotors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForeignSender {
    /// Its command holds a number for each ESC from index 0 to `last`.
    Commands {
        /// Its number.
        node: u8,
        /// Highest index.
        last: u8,
        /// Whether an ESC of ours is among them; else ours are behind, and our command holds zeros for its ESCs.
        reaches_ours: bool,
    },
    /// It says to all ESCs whether their rotors may turn.
    Arms {
        /// Its number.
        node: u8,
        /// What it says: 255 = they may.
        status: u8,
    },
}

impl ForeignSender {
    /// What a log says of it: constant sentences, each with its number.
    #[must_use]
    pub fn said(self) -> [(&'static str, f64); 2] {
        let (node, said) = match self {
            Self::Commands { node, last, reaches_ours: true } => (
                node,
                ("its command has a number for every ESC from index 0, ours among them, to index", last),
            ),
            Self::Commands { node, last, reaches_ours: false } => {
                let text =
                    "its command ends before our ESCs, and ours commands zero to its, from index 0 to index";
                (node, (text, last))
            }
            Self::Arms { node, status } => (
                node,
                ("it says in ArmingStatus, to every ESC, whether rotors may turn (255): it says", status),
            ),
        };
        [("the other sender is node", f64::from(node)), (said.0, f64::from(said.1))]
    }
}

/// Identifiers: those that agree with one in some bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IdFilter {
    /// The one.
    pub id: Id,
    /// The bits.
    pub bits: u32,
}

impl IdFilter {
    /// This one alone.
    #[must_use]
    pub fn exactly(id: Id) -> Self {
        Self { id, bits: u32::MAX }
    }
}

/// A message of the bench, as `check` shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct MessageDescription {
    /// Its name, with the node where that is part of it.
    pub name: String,
    /// Whether the bridge sends it.
    pub is_sent: bool,
    /// Identifier on the bus; the bits of a node that nobody named are zero.
    pub id: Id,
    /// [byte] length of what it carries.
    pub bytes: usize,
    /// [s] period at which it is sent.
    pub period_s: f64,
    /// Name of its counter, where it has one.
    pub counter: Option<String>,
    /// Whether it may have one: else the protocol itself tells a new message from an old one.
    pub may_have_counter: bool,
    /// Whether its identifier has a place for a node, and nobody named one.
    pub lacks_node: bool,
    /// What is used of it.
    pub signals: Vec<SignalDescription>,
}

/// A signal in its role, as `check` shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalDescription {
    /// Key in the bench file, below `[bus]`.
    pub role: String,
    /// The channel that it feeds; `None` of a command.
    pub channel: Option<Channel>,
    /// Its name in its message.
    pub name: String,
    /// Number, order and first bit.
    pub place: String,
    /// Its unit; empty where nothing says one.
    pub unit: String,
    /// Unit inside the program.
    pub si_unit: &'static str,
    /// SI value = raw number * `factor` + `offset`.
    pub factor: f64,
    /// See `factor`.
    pub offset: f64,
    /// Least and greatest value that is accepted, in SI.
    pub range: (f64, f64),
}
