//! A bus, opened by the name that the bench file gives its interface: whatever carries the frames.

use std::os::fd::{AsRawFd, RawFd};

use super::bus::{Arrival, Bus, BusFault, PortCounts};
use super::error::CanError;
use super::frame::Frame;
use super::interface::{InterfaceAnswer, InterfaceStatus};
use super::multicast::{MulticastGroup, MulticastPort};
use super::port::{Port, kernel_has_can};
use super::protocol::IdFilter;

/// An open bus.
#[derive(Debug)]
pub enum BusPort {
    /// A CAN interface.
    Can(Port),
    /// A group of UDP multicast.
    Multicast(MulticastPort),
}

/// Does the same with either.
macro_rules! each {
    ($port:expr, $it:ident => $act:expr) => {
        match $port {
            BusPort::Can($it) => $act,
            BusPort::Multicast($it) => $act,
        }
    };
}

impl BusPort {
    /// Opens it; the echo of what it sends is among its arrivals.
    ///
    /// # Errors
    /// See [`Port::open`] and [`MulticastPort::open`].
    pub fn open(interface: &str, fd: bool) -> Result<Self, CanError> {
        match group(interface)? {
            Some(group) => MulticastPort::open(&group, fd).map(Self::Multicast),
            None => Port::open(interface, fd).map(Self::Can),
        }
    }

    /// Opens it to hear whatever it carries: FD frames, too, where it has them.
    ///
    /// # Errors
    /// See [`BusPort::open`].
    pub fn open_for_all_frames(interface: &str) -> Result<Self, CanError> {
        let has_fd = match group(interface)? {
            Some(_) => true,
            None => InterfaceStatus::find(interface).ok().flatten().is_some_and(|status| status.fd),
        };
        Self::open(interface, has_fd)
    }

    /// Opens it to send frames with such identifiers and no others: see [`Port::open_with_echo_of`]. On multicast the echo is
    /// among the arrivals.
    ///
    /// # Errors
    /// See [`BusPort::open`].
    pub fn open_with_echo_of(interface: &str, fd: bool, own: &[IdFilter]) -> Result<Self, CanError> {
        match group(interface)? {
            Some(group) => MulticastPort::open(&group, fd).map(Self::Multicast),
            None => Port::open_with_echo_of(interface, fd, own).map(Self::Can),
        }
    }
}

/// The group that a name means; `None` of a CAN interface.
fn group(interface: &str) -> Result<Option<MulticastGroup>, CanError> {
    let fail = |reason| CanError::Interface { interface: interface.to_owned(), reason };
    MulticastGroup::parse(interface).transpose().map_err(fail)
}

/// Whether a bus of this name is there, so that it could be opened.
///
/// # Errors
/// What is missing.
pub fn check_there(interface: &str) -> Result<(), CanError> {
    if let Some(group) = group(interface)? {
        return group.ready().map(drop);
    }
    if !kernel_has_can() {
        return Err(CanError::no_can(interface));
    }
    InterfaceStatus::read(interface).map(drop)
}

/// Whether `interface` is virtual: no wire leaves this machine. A serial adapter (slcan) is listed among the virtual
/// interfaces, too: newer kernels give it a controller's state, older ones only the name that its user gave it.
#[must_use]
pub fn is_virtual(interface: &str) -> bool {
    if let Some(group) = MulticastGroup::parse(interface) {
        return group.is_ok_and(|group| group.ready().is_ok_and(|device| device.is_loopback));
    }
    let is_named_real = ["can", "slcan"].iter().any(|kind| interface.starts_with(kind));
    let is_listed = std::path::Path::new("/sys/devices/virtual/net").join(interface).exists();
    !is_named_real && is_listed && InterfaceStatus::read(interface).is_ok_and(|status| status.state.is_none())
}

impl Bus for BusPort {
    fn receive(&mut self, take: impl FnMut(Arrival)) -> Result<usize, BusFault> {
        each!(self, it => it.receive(take))
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusFault> {
        each!(self, it => it.send(frame))
    }

    fn send_all(&mut self, frames: &[Frame]) -> (u64, Option<BusFault>) {
        each!(self, it => it.send_all(frames))
    }

    fn listen(&mut self) {
        each!(self, it => it.listen());
    }

    fn echo_age_ns(&self, now_ns: u64) -> u64 {
        each!(self, it => it.echo_age_ns(now_ns))
    }

    fn counts(&self) -> PortCounts {
        each!(self, it => it.counts())
    }

    fn now_ns(&self) -> u64 {
        each!(self, it => it.now_ns())
    }

    fn look_at(&mut self, now_ns: u64) {
        each!(self, it => it.look_at(now_ns));
    }

    fn looked_ns(&self) -> u64 {
        each!(self, it => it.looked_ns())
    }

    fn ask(&self) {
        each!(self, it => it.ask());
    }

    fn answer(&self) -> Option<InterfaceAnswer> {
        each!(self, it => it.answer())
    }

    fn is_gone(&self) -> bool {
        each!(self, it => it.is_gone())
    }
}

/// Readable when something arrived: for `ppoll`.
impl AsRawFd for BusPort {
    fn as_raw_fd(&self) -> RawFd {
        each!(self, it => it.as_raw_fd())
    }
}
