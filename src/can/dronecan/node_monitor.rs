//! Who is on the bus: listens to what each node says of itself, and asks it what it is.

use std::collections::BTreeMap;

use crate::can::error::CanError;
use crate::can::frame::Frame;
use crate::can::resolve::fail;
use crate::can::thresholds::THRESHOLDS;

use super::assembler::{Assembler, Subscription};
use super::common::{self, Common};
use super::dsdl::{CompoundBody, Structure};
use super::library::Library;
use super::node::Node;
use super::participant::Participant;
use super::transfer::{GREATEST_NODE, TransferFrames, TransferHeader, TransferId, TransferKind, priority};
use super::value::{Value, decode};

/// Which of its subscriptions is that of a node that asks who this is.
const INFO_REQUEST: usize = 2;
/// How this node names itself while it asks, and where it gives node ids.
const NAME: &str = "org.rotorbench.list";
const ALLOCATOR: &str = "org.rotorbench.allocate";

/// A node as it says of itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NodeReport {
    /// Its number.
    pub id: u8,
    /// 0 ok, 1 warning, 2 error, 3 critical.
    pub health: u8,
    /// 0 operational, 1 initialization, 2 maintenance, 3 software update, 7 offline.
    pub mode: u8,
    /// [s] since it began.
    pub uptime_s: u32,
    /// Its own status code.
    pub code: u16,
    /// What it is; `None` = it did not answer.
    pub info: Option<NodeInfo>,
}

/// What a node answers to `GetNodeInfo`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NodeInfo {
    /// Its name.
    pub name: String,
    /// Major and minor version of its software.
    pub software: (u8, u8),
    /// Major and minor version of its hardware.
    pub hardware: (u8, u8),
    /// Its unique id.
    pub unique_id: Vec<u8>,
}

/// Watches for nodes, and asks each what it is.
#[derive(Debug)]
pub struct NodeMonitor {
    common: Common,
    response: Structure,
    seed: u16,
    assembler: Assembler,
    node: Node,
    transfer_ids: BTreeMap<u8, TransferId>,
    /// By number: what is known, and when it was asked last [ns].
    nodes: BTreeMap<u8, (NodeReport, u64)>,
}

impl NodeMonitor {
    /// Asks as the node with the number `own`.
    ///
    /// # Errors
    /// [`CanError::Role`] when that is no node's number.
    pub fn new(own: u8) -> Result<Self, CanError> {
        Self::named(own, NAME)
    }

    /// The same as the node that gives node ids.
    ///
    /// # Errors
    /// See [`NodeMonitor::new`].
    pub fn of_allocator(own: u8) -> Result<Self, CanError> {
        Self::named(own, ALLOCATOR)
    }

    fn named(own: u8, name: &str) -> Result<Self, CanError> {
        if !(1..=GREATEST_NODE).contains(&own) {
            return Err(fail("dronecan.node_id", format!("{own} is no node id of 1 to {GREATEST_NODE}")));
        }
        let library = Library::build(&[])?;
        let common = Common::build(&library)?;
        let response = match library.get(common::name::NODE_INFO).map(|it| &it.body) {
            Some(CompoundBody::Service(_, response)) => response.clone(),
            _ => return Err(fail("dronecan", format!("no type `{}`", common::name::NODE_INFO))),
        };
        let kind = TransferKind::Response { to: own };
        let answers = Subscription::new(common.info_id, kind, common.info_signature, response.most_bits());
        Ok(Self {
            assembler: Assembler::new(vec![common.status, answers, common.info_request(own)]),
            node: Node::new(&common, own, name),
            seed: answers.seed,
            transfer_ids: BTreeMap::new(),
            nodes: BTreeMap::new(),
            common,
            response,
        })
    }

    /// The number that it asks under.
    #[must_use]
    pub fn own(&self) -> u8 {
        self.node.id
    }

    /// Who was heard, by number.
    #[must_use]
    pub fn nodes(&self) -> Vec<NodeReport> {
        self.nodes.values().map(|(report, _)| report.clone()).collect()
    }
}

impl Participant for NodeMonitor {
    fn receive(&mut self, frame: &Frame, now_ns: u64) {
        // What is not whole is asked for again.
        let Ok(Some(transfer)) = self.assembler.receive(frame, now_ns) else { return };
        let id = transfer.header.source;
        if transfer.subscription == INFO_REQUEST {
            self.node.ask(&transfer);
            return;
        }
        let (report, _) = self.nodes.entry(id).or_default();
        report.id = id;
        if transfer.subscription == 0 {
            let read = |place: &super::place::BitPlace| {
                place.read(transfer.payload, transfer.framing).unwrap_or(0.0)
            };
            report.health = read(&self.common.health) as u8;
            report.mode = read(&self.common.mode) as u8;
            report.uptime_s = read(&self.common.uptime) as u32;
            report.code = read(&self.common.code) as u16;
        } else if let Ok(Value::List(fields)) = decode(&self.response, transfer.payload, transfer.framing) {
            report.info = info(&fields);
        }
    }

    fn due_frames(&mut self, now_ns: u64) -> Vec<Frame> {
        let mut frames: Vec<Frame> = self.node.status(now_ns, 0).into_iter().collect();
        frames.extend(std::iter::from_fn(|| self.node.answer()));
        for (id, (report, asked_ns)) in &mut self.nodes {
            let is_time = *asked_ns == 0 || now_ns.saturating_sub(*asked_ns) >= THRESHOLDS.ask_again_ns;
            if report.info.is_some() || !is_time {
                continue;
            }
            *asked_ns = now_ns;
            let header = TransferHeader {
                priority: priority::LOW,
                type_id: self.common.info_id,
                source: self.node.id,
                kind: TransferKind::Request { to: *id },
                discriminator: 0,
            };
            let transfer_id = self.transfer_ids.entry(*id).or_default().take();
            frames.extend(TransferFrames::new(header, self.seed, transfer_id, &[]));
        }
        frames
    }
}

/// Of an answer: state, software, hardware, name.
fn info(fields: &[Value]) -> Option<NodeInfo> {
    let list = |value: &Value| match value {
        Value::List(values) => values.clone(),
        _ => Vec::new(),
    };
    let byte = |value: &Value| match value {
        Value::Integer(integer) => u8::try_from(*integer).unwrap_or(0),
        _ => 0,
    };
    let [_, software, hardware, name] = fields else { return None };
    let version = |value: &Value| match list(value).as_slice() {
        [major, minor, ..] => (byte(major), byte(minor)),
        _ => (0, 0),
    };
    let name: Vec<u8> = list(name).iter().map(byte).collect();
    let unique_id = list(hardware).get(2).map(list).unwrap_or_default();
    Some(NodeInfo {
        name: String::from_utf8_lossy(&name).into_owned(),
        software: version(software),
        hardware: version(hardware),
        unique_id: unique_id.iter().map(byte).collect(),
    })
}
