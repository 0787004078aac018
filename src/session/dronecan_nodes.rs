//! Who is on a bus that speaks DroneCAN.

use std::os::fd::AsRawFd;

use crate::can::dronecan::{NodeReport, RollCall};
use crate::can::{Arrival, CanError, Port};
use crate::clock;
use crate::rt;

/// [ns] between two looks at what is to be sent, though no frame comes.
const LOOK_EVERY_NS: u64 = 50_000_000;

/// Listens on `interface` for `seconds`, as the node with the number `own`, and asks each node that is heard what it is.
///
/// # Errors
/// A number that no node has; an interface that cannot be opened, or goes down.
pub fn dronecan_nodes(interface: &str, own: u8, seconds: f64) -> Result<Vec<NodeReport>, CanError> {
    let mut call = RollCall::new(own)?;
    let mut port = Port::open(interface, false)?;
    let end_ns = clock::monotonic_ns().saturating_add(clock::span_ns(seconds));
    loop {
        let now_ns = clock::monotonic_ns();
        if now_ns >= end_ns {
            return Ok(call.nodes());
        }
        let received = port.receive(|arrival| {
            if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
                call.receive(&frame, stamp_ns);
            }
        });
        received.map_err(|fault| CanError::Interface {
            interface: interface.to_owned(),
            reason: fault.to_string(),
        })?;
        for frame in call.owed(now_ns) {
            // Dropped where there is no room: asked again.
            let _ = port.send(&frame);
        }
        let _ = rt::wait([port.as_raw_fd()], end_ns.min(now_ns + LOOK_EVERY_NS));
    }
}
