//! Who is on a bus that speaks DroneCAN.

use super::dronecan_own_id::own_node_id;
use super::dronecan_wire::{PortWire, Wire};
use crate::can::CanError;
use crate::can::dronecan::{NodeMonitor, NodeReport};
use crate::clock;

/// Listens on `interface` for `seconds`, as the node with the number `own` or one that nobody has, and asks each node that is heard
/// what it is.
///
/// # Errors
/// A number that no node has; an interface that cannot be opened, or goes down.
pub fn dronecan_nodes(interface: &str, own: Option<u8>, seconds: f64) -> Result<Vec<NodeReport>, CanError> {
    let mut wire = PortWire::open(interface)?;
    let mut monitor = NodeMonitor::new(own_node_id(&mut wire, own, |_| false)?)?;
    let end_ns = wire.now_ns().saturating_add(clock::span_ns(seconds));
    while wire.turn(&mut monitor, end_ns)? < end_ns {}
    Ok(monitor.nodes())
}
