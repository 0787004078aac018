//! A node id of the bench's own, where the bench file leaves that to an allocator: asked for once, before a bench is there.

use std::fs;
use std::time::Duration;

use crate::can::bus::{Arrival, Bus};
use crate::can::bus_port::BusPort;
use crate::can::config::BusConfig;
use crate::can::error::CanError;
use crate::can::thresholds::THRESHOLDS;
use crate::clock;

use super::allocatee::Allocatee;
use super::allocation::{UNIQUE, UniqueId};
use super::config::NodeId;
use super::participant::Participant;

/// The unique id of a bench: of this machine, the interface and the ESCs, so that it is the same after each start and no other
/// bench has it.
pub(super) fn unique_id(config: &BusConfig) -> UniqueId {
    let machine = fs::read_to_string("/etc/machine-id")
        .or_else(|_| fs::read_to_string("/proc/sys/kernel/hostname"))
        .unwrap_or_default();
    let whole = format!("rotorbench {} {} {:?}", machine.trim(), config.interface, config.dronecan.esc_index);
    hash(whole.as_bytes())
}

/// The unique id of a node that an emulator of this bench plays, by the id that the node has by itself: another one on each
/// machine, and the same after each start.
pub(super) fn emulated_unique_id(bench: UniqueId, node_id: u8) -> UniqueId {
    let whole: Vec<u8> = bench.0.into_iter().chain([node_id]).collect();
    hash(&whole)
}

/// Twice FNV-1a, forwards and backwards: nothing of the machine can be read from it.
fn hash(whole: &[u8]) -> UniqueId {
    let hash = |bytes: &mut dyn Iterator<Item = &u8>| {
        bytes.fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        })
    };
    let mut bytes = [0; UNIQUE];
    let (low, high) = bytes.split_at_mut(UNIQUE / 2);
    low.copy_from_slice(&hash(&mut whole.iter()).to_le_bytes());
    high.copy_from_slice(&hash(&mut whole.iter().rev()).to_le_bytes());
    UniqueId(bytes)
}

/// The same table with a node id: asks an allocator where there is none yet, and says nothing else meanwhile; until `is_over`.
///
/// # Errors
/// An interface that cannot be opened or goes down, and [`CanError::Interface`] where nobody gives one in time.
pub fn join(config: &BusConfig, is_over: &dyn Fn() -> bool) -> Result<BusConfig, CanError> {
    let mut config = config.clone();
    if config.dronecan.node_id != NodeId::Dynamic {
        return Ok(config);
    }
    let fail = |reason: String| CanError::Interface { interface: config.interface.clone(), reason };
    let mut port = BusPort::open_for_all_frames(&config.interface)?;
    let mut allocatee = Allocatee::new(unique_id(&config), 0)?;
    let end_ns = clock::monotonic_ns().saturating_add(THRESHOLDS.allocation_patience_ns);
    while clock::monotonic_ns() < end_ns {
        if is_over() {
            return Err(fail("asked to end before this bench had a node id".to_owned()));
        }
        let received = port.receive(|arrival| {
            if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
                allocatee.receive(&frame, stamp_ns);
            }
        });
        received.map_err(|fault| fail(fault.to_string()))?;
        if let Some((node_id, _)) = allocatee.given() {
            config.dronecan.node_id = NodeId::Allocated(node_id);
            return Ok(config);
        }
        for frame in allocatee.due_frames(clock::monotonic_ns()) {
            // Dropped where there is no room: asked again.
            let _ = port.send(&frame);
        }
        std::thread::sleep(Duration::from_nanos(THRESHOLDS.allocation_look_ns));
    }
    let seconds = clock::span_s(THRESHOLDS.allocation_patience_ns);
    Err(fail(match allocatee.allocator() {
        Some(node) => format!("node {node} gives node ids, and gave none to this bench within {seconds} s"),
        None => format!(
            "nobody gave this bench a node id within {seconds} s: `rotorbench dronecan allocate` does, or name one in bus.dronecan.node_id"
        ),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emulated_nodes_have_ids_of_their_own_that_stay_and_those_of_another_machine_are_others() {
        let bench = |byte: u8| UniqueId([byte; UNIQUE]);
        let mut all: Vec<UniqueId> = (1..=127).map(|id| emulated_unique_id(bench(1), id)).collect();
        assert_eq!(all[19], emulated_unique_id(bench(1), 20), "the same again");
        all.extend((1..=127).map(|id| emulated_unique_id(bench(2), id)));
        all.extend([bench(1), bench(2)]);
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count);
    }

    #[test]
    fn who_waits_for_an_id_ends_when_asked_to() {
        let mut config = BusConfig { interface: "mcast:251".to_owned(), ..BusConfig::default() };
        config.dronecan.node_id = NodeId::Dynamic;
        let asked = std::cell::Cell::new(0);
        let is_over = || asked.replace(asked.get() + 1) >= 3;
        let said = join(&config, &is_over).expect_err("nobody gave one").to_string();
        assert!(said.contains("asked to end before this bench had a node id"), "{said}");
        assert_eq!(asked.get(), 4, "at the first look after it was asked to");
    }
}
