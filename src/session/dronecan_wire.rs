//! A bus for a participant without a bench: frames to and fro, and the time.

use std::os::fd::AsRawFd;

use crate::can::dronecan::Participant;
use crate::can::{Arrival, Bus, BusPort, CanError};
use crate::clock;
use crate::rt;

/// [ns] between two looks at what is to be sent, though no frame comes.
const LOOK_EVERY_NS: u64 = 50_000_000;

/// What carries the frames.
pub(super) trait Wire {
    /// Lets `participant` hear and speak for a moment, which ends at `until_ns` at the latest; the time after it [ns].
    ///
    /// # Errors
    /// A bus that is no longer there.
    fn turn(&mut self, participant: &mut dyn Participant, until_ns: u64) -> Result<u64, CanError>;

    /// [ns] now.
    fn now_ns(&self) -> u64;
}

/// A CAN interface.
pub(super) struct PortWire {
    interface: String,
    port: BusPort,
}

impl PortWire {
    /// Opens it.
    ///
    /// # Errors
    /// See [`BusPort::open`].
    pub(super) fn open(interface: &str) -> Result<Self, CanError> {
        Ok(Self { port: BusPort::open_for_all_frames(interface)?, interface: interface.to_owned() })
    }
}

impl Wire for PortWire {
    fn turn(&mut self, participant: &mut dyn Participant, until_ns: u64) -> Result<u64, CanError> {
        let received = self.port.receive(|arrival| {
            if let Arrival::Frame { frame, stamp_ns, .. } = arrival {
                participant.receive(&frame, stamp_ns);
            }
        });
        received.map_err(|fault| CanError::Interface {
            interface: self.interface.clone(),
            reason: fault.to_string(),
        })?;
        let now_ns = clock::monotonic_ns();
        for frame in participant.due_frames(now_ns) {
            // Dropped where there is no room: still due.
            let _ = self.port.send(&frame);
        }
        let _ = rt::wait([self.port.as_raw_fd()], until_ns.min(now_ns.saturating_add(LOOK_EVERY_NS)));
        Ok(clock::monotonic_ns())
    }

    fn now_ns(&self) -> u64 {
        clock::monotonic_ns()
    }
}
