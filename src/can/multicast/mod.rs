//! A bus without CAN: frames in datagrams of UDP multicast, as DroneCAN's tools speak it (`mcast:0`). For trying out: nothing
//! arbitrates, nothing acknowledges, and who is in the network may say anything.
//!
//! On the loopback unless another device is named. What is sent comes back as the echo, which is all that tells a bus that
//! carries datagrams from one that does not.

mod datagram;
mod group;
mod socket;

use std::fmt;
use std::io;
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::os::fd::{AsRawFd, RawFd};

use crate::clock;

use super::bus::{Arrival, Bus, BusFault, PortCounts, give_each};
use super::echo::Awaited;
use super::error::CanError;
use super::frame::Frame;
use super::stamp::StampClock;

pub use group::MulticastGroup;
pub use socket::NetworkDevice;

use datagram::LONGEST;
use socket::{BATCH, DatagramBatch};

/// Most datagrams that one [`MulticastPort::receive`] takes, so that a flood cannot hold the cycle.
const MOST: usize = 16 * BATCH;

/// A member of a group. Belongs to one thread at a time.
pub struct MulticastPort {
    heard: UdpSocket,
    said: UdpSocket,
    /// Where our own datagrams come from.
    own: SocketAddr,
    fd: bool,
    batch: Box<DatagramBatch>,
    stamps: StampClock,
    looked_ns: u64,
    counts: PortCounts,
    last_dropped: u32,
    awaited: Awaited,
}

impl MulticastPort {
    /// Joins the group on its device, which must be up. With `fd` it takes and sends FD frames, too.
    ///
    /// # Errors
    /// [`CanError::Interface`] when the device is missing or down; [`CanError::Socket`] when the operating system refuses
    /// something.
    pub fn open(group: &MulticastGroup, fd: bool) -> Result<Self, CanError> {
        let device = group.ready()?;
        let address = SocketAddrV4::new(group.address(), group::PORT);
        let refused = |action| move |source: io::Error| group.refused(action, source);
        let heard = socket::listener(address, &device).map_err(refused("cannot be listened to"))?;
        let said = socket::speaker(address, &device).map_err(refused("cannot be sent to"))?;
        let own = said.local_addr().map_err(refused("does not say where it sends from"))?;
        let looked_ns = clock::monotonic_ns();
        Ok(Self {
            heard,
            said,
            own,
            fd,
            batch: DatagramBatch::new(),
            stamps: StampClock::new(looked_ns),
            looked_ns,
            counts: PortCounts::default(),
            last_dropped: 0,
            awaited: Awaited::new(),
        })
    }
}

impl Bus for MulticastPort {
    fn receive(&mut self, mut take: impl FnMut(Arrival)) -> Result<usize, BusFault> {
        let (mut total, mut echoed) = (0, 0);
        let Self { heard, own, fd, batch, stamps, looked_ns, counts, last_dropped, .. } = self;
        while total < MOST {
            *looked_ns = clock::monotonic_ns().max(*looked_ns);
            let realtime_ns = clock::realtime_ns();
            let received = batch.receive(heard.as_raw_fd(), |datagram| {
                let stamp_ns = stamps.software(datagram.control.software_ns, *looked_ns, realtime_ns);
                if let Some(dropped) = datagram.control.dropped {
                    counts.dropped += u64::from(dropped.wrapping_sub(*last_dropped));
                    *last_dropped = dropped;
                }
                let Some(frame) = datagram::parse(datagram.bytes, *fd) else {
                    counts.malformed += 1;
                    return;
                };
                if SocketAddr::V4(datagram.sender) == *own {
                    (echoed, counts.echoed) = (echoed + 1, counts.echoed + 1);
                    take(Arrival::Echo { frame, stamp_ns });
                } else {
                    counts.received += 1;
                    take(Arrival::Frame { frame, stamp_ns, hardware_ns: None });
                }
            });
            let received = received.map_err(|error| BusFault::of(&error))?;
            total += received;
            if received < BATCH {
                stamps.empty_ns = *looked_ns;
                break;
            }
        }
        self.awaited.seen(echoed);
        Ok(total)
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusFault> {
        self.send_all(std::slice::from_ref(frame)).1.map_or(Ok(()), Err)
    }

    fn send_all(&mut self, frames: &[Frame]) -> (u64, Option<BusFault>) {
        let (given, now_ns, fault) = give_each(frames, |frame| self.give(frame));
        if !frames.is_empty() {
            self.awaited.sent(given, now_ns);
        }
        (now_ns, fault)
    }

    fn echo_age_ns(&self, now_ns: u64) -> u64 {
        self.awaited.since_ns().map_or(0, |since| now_ns.saturating_sub(since))
    }

    fn counts(&self) -> PortCounts {
        self.counts
    }

    fn now_ns(&self) -> u64 {
        clock::monotonic_ns()
    }

    fn looked_ns(&self) -> u64 {
        self.looked_ns
    }
}

impl MulticastPort {
    /// Sends a frame now, or drops it and counts why.
    fn give(&mut self, frame: &Frame) -> Result<(), BusFault> {
        let mut buffer = [0; LONGEST];
        let datagram = datagram::emit(frame, &mut buffer);
        let sent = datagram.ok_or_else(|| io::Error::from_raw_os_error(libc::EOPNOTSUPP));
        let fault = match sent.and_then(|datagram| self.said.send(datagram)) {
            Ok(_) => {
                self.counts.sent += 1;
                return Ok(());
            }
            Err(error) => BusFault::of(&error),
        };
        self.counts.refuse(fault);
        Err(fault)
    }
}

/// Readable when something arrived: for `ppoll`.
impl AsRawFd for MulticastPort {
    fn as_raw_fd(&self) -> RawFd {
        self.heard.as_raw_fd()
    }
}

impl fmt::Debug for MulticastPort {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("MulticastPort")
            .field("own", &self.own)
            .field("counts", &self.counts)
            .finish_non_exhaustive()
    }
}
