//! The nodes that a bench needs: whose values it uses, when each said last how it is, and how it is.

use crate::can::protocol::NodeTrouble;
use crate::can::thresholds::THRESHOLDS;
use crate::signal::Channel;

use super::assembler::Transfer;
use super::common::Common;
use super::transfer::GREATEST_NODE;

/// Node ids, 0 among them.
const NODES: usize = GREATEST_NODE as usize + 1;
/// A node that says of itself that it fails, from here on.
const FAILING: f64 = 2.0;
/// Modes in which a node is at work, or about to be.
const STARTING: f64 = 1.0;

/// What is known of a node.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    /// [ns] when it said last how it is, or gave its first value.
    heard_ns: u64,
    uptime_s: f64,
    is_unwell: bool,
    /// [ns] when it last began anew, and when two seemed to have its id.
    began_ns: u64,
    twice_ns: u64,
}

/// Who gives a channel its values.
#[derive(Debug, Clone, Copy, Default)]
struct Source {
    node: u8,
    /// [ns] of the last value.
    newest_ns: u64,
}

/// What is known of all of them.
#[derive(Debug, Clone)]
pub(super) struct NodeWatch {
    nodes: Vec<Known>,
    sources: [Source; Channel::ALL.len()],
}

impl NodeWatch {
    pub fn new() -> Self {
        Self { nodes: vec![Known::default(); NODES], sources: [Source::default(); Channel::ALL.len()] }
    }

    /// Whether `node` may give a channel its value: of two who do, the first one, until it is silent.
    pub fn is_believed(&self, channel: Channel, node: u8, now_ns: u64) -> bool {
        self.sources.get(channel as usize).is_none_or(|source| {
            source.node == node
                || source.node == 0
                || now_ns.saturating_sub(source.newest_ns) > THRESHOLDS.node_silent_ns
        })
    }

    /// `node` gave a channel its value.
    pub fn gave(&mut self, channel: Channel, node: u8, now_ns: u64) {
        if let Some(source) = self.sources.get_mut(channel as usize) {
            *source = Source { node, newest_ns: now_ns };
        }
        if let Some(known) = self.nodes.get_mut(usize::from(node))
            && known.heard_ns == 0
        {
            known.heard_ns = now_ns;
        }
    }

    /// A node says how it is.
    pub fn heard(&mut self, common: &Common, status: &Transfer<'_>) {
        let (node, now_ns) = (status.header.source, status.stamp_ns);
        let read = |place: &super::place::BitPlace| place.read(status.payload, status.framing);
        let (Some(known), Some(uptime_s), Some(health), Some(mode)) = (
            self.nodes.get_mut(usize::from(node)),
            read(&common.uptime),
            read(&common.health),
            read(&common.mode),
        ) else {
            return;
        };
        if uptime_s < known.uptime_s {
            let since_ns = now_ns.saturating_sub(known.began_ns);
            if known.began_ns > 0 && since_ns < THRESHOLDS.node_restart_apart_ns {
                known.twice_ns = now_ns;
            }
            known.began_ns = now_ns;
        }
        known.uptime_s = uptime_s;
        known.heard_ns = now_ns;
        known.is_unwell = health >= FAILING || mode > STARTING;
    }

    /// Somebody else uses this node's id.
    pub fn twice(&mut self, node: u8, now_ns: u64) {
        if let Some(known) = self.nodes.get_mut(usize::from(node)) {
            known.twice_ns = now_ns;
        }
    }

    /// What is wrong at `now_ns` with a node whose values are used, or with `own`.
    pub fn trouble(&self, own: u8, now_ns: u64) -> Option<NodeTrouble> {
        let is_recent =
            |stamp_ns: u64| stamp_ns > 0 && now_ns.saturating_sub(stamp_ns) <= THRESHOLDS.node_silent_ns;
        let used = self.sources.iter().map(|source| source.node).filter(|node| *node != 0);
        let find = |node: u8| {
            let known = self.nodes.get(usize::from(node))?;
            if is_recent(known.twice_ns) {
                Some(NodeTrouble::Twice { node })
            } else if node != own && !is_recent(known.heard_ns) {
                Some(NodeTrouble::Silent { node })
            } else {
                known.is_unwell.then_some(NodeTrouble::Unhealthy { node })
            }
        };
        used.chain(std::iter::once(own)).find_map(find)
    }
}
