//! A SocketCAN interface: frames in with their stamps, frames out without waiting.
//!
//! What is sent is only ever the newest: a frame the interface cannot take now is dropped and counted, never kept
//! or tried again, and the socket may hold no more than a few, so that a bus that comes back does not carry out
//! commands of the past.

use std::fmt;
use std::io;
use std::os::fd::{AsRawFd, RawFd};

use socketcan::{CanSocket, Socket, SocketOptions};

use crate::clock;

use super::bus::{Arrival, Bus, BusFault, PortCounts, give_each};
use super::echo::{Awaited, EchoSocket};
use super::error::CanError;
use super::error_frame::ErrorFrame;
use super::frame::{Frame, Id};
use super::interface::{InterfaceAnswer, InterfaceStatus, InterfaceWatch};
use super::protocol::IdFilter;
use super::socket::{self, BATCH, Batch, EVERYTHING, RawArrival};
use super::stamp::StampClock;
use super::thresholds::THRESHOLDS;

/// Most frames that one [`Port::receive`] takes, so that a flood cannot hold the cycle.
const MOST: usize = 16 * BATCH;

/// Frames that it has room for at first. There is one, as a rule; preparing room for many more takes as long as decoding it.
const FEW: usize = 4;

impl Bus for Port {
    fn receive(&mut self, take: impl FnMut(Arrival)) -> Result<usize, BusFault> {
        Self::receive(self, take)
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusFault> {
        Self::send(self, frame)
    }

    fn send_all(&mut self, frames: &[Frame]) -> (u64, Option<BusFault>) {
        Self::send_all(self, frames)
    }

    fn listen(&mut self) {
        Self::listen(self);
    }

    fn echo_age_ns(&self, now_ns: u64) -> u64 {
        Self::echo_age_ns(self, now_ns)
    }

    fn counts(&self) -> PortCounts {
        Self::counts(self)
    }

    fn now_ns(&self) -> u64 {
        clock::monotonic_ns()
    }

    fn look_at(&mut self, now_ns: u64) {
        self.given_ns = Some(now_ns);
    }

    fn looked_ns(&self) -> u64 {
        self.looked_ns
    }

    fn ask(&self) {
        Self::ask(self);
    }

    fn answer(&self) -> Option<InterfaceAnswer> {
        Self::answer(self)
    }

    fn is_gone(&self) -> bool {
        self.is_gone
    }
}

/// An open, non-blocking port. Belongs to one thread at a time.
pub struct Port {
    socket: CanSocket,
    watch: InterfaceWatch,
    is_gone: bool,
    batch: Box<Batch>,
    stamps: StampClock,
    /// [ns] when it looked for arrivals last, and the time it was given for the next look.
    looked_ns: u64,
    given_ns: Option<u64>,
    counts: PortCounts,
    last_dropped: u32,
    awaited: Awaited,
    /// `None` = they come with everything else.
    echoes: Option<EchoSocket>,
}

impl Port {
    /// Opens `interface`, which must be up. The echo of what it sends is among its arrivals.
    ///
    /// # Errors
    /// [`CanError::Interface`] when it is missing, down or, for `fd`, carries no FD frames, with what mends it;
    /// [`CanError::Socket`] when the operating system refuses something.
    pub fn open(interface: &str, fd: bool) -> Result<Self, CanError> {
        let fail = |reason: String| CanError::Interface { interface: interface.to_owned(), reason };
        if !kernel_has_can() {
            return Err(CanError::no_can(interface));
        }
        let status = InterfaceStatus::read(interface)?;
        if !status.is_up {
            return Err(fail(format!("it is down (sudo ip link set {interface} up)")));
        }
        if fd && !status.fd {
            return Err(fail(format!("it carries no FD frames (sudo ip link set {interface} mtu 72)")));
        }
        let refuse = |action: &'static str| {
            move |source: io::Error| CanError::Socket { interface: interface.to_owned(), action, source }
        };
        let socket = CanSocket::open(interface).map_err(refuse("cannot be opened"))?;
        socket::configure(&socket, fd).map_err(refuse("refuses a socket option"))?;
        let looked_ns = clock::monotonic_ns();
        let stamps = StampClock::new(looked_ns);
        Ok(Self {
            socket,
            watch: InterfaceWatch::start(interface, InterfaceStatus { fd, ..status })?,
            is_gone: false,
            batch: Batch::new(),
            stamps,
            looked_ns,
            given_ns: None,
            counts: PortCounts::default(),
            last_dropped: 0,
            awaited: Awaited::new(),
            echoes: None,
        })
    }

    /// See [`Port::open_with_echo_of`], of frames with exactly these identifiers.
    ///
    /// # Errors
    /// See [`Port::open`].
    pub fn open_with_echo_apart(interface: &str, fd: bool, ids: &[Id]) -> Result<Self, CanError> {
        let own: Vec<IdFilter> = ids.iter().copied().map(IdFilter::exactly).collect();
        Self::open_with_echo_of(interface, fd, &own)
    }

    /// Opens `interface` to send frames with such identifiers and no others. Their echo is not among the arrivals and wakes
    /// nobody: it is there for [`Port::listen`].
    ///
    /// # Errors
    /// See [`Port::open`].
    pub fn open_with_echo_of(interface: &str, fd: bool, own: &[IdFilter]) -> Result<Self, CanError> {
        let mut port = Self::open(interface, fd)?;
        let refuse = |source: io::Error| CanError::Socket {
            interface: interface.to_owned(),
            action: "cannot have its echo on a socket apart",
            source,
        };
        port.echoes = Some(EchoSocket::open(interface, fd, own).map_err(refuse)?);
        port.socket.set_recv_own_msgs(false).map_err(refuse)?;
        Ok(port)
    }

    /// Hands every arrival that is there now to `take`, the oldest first; the number taken. When it is a few
    /// hundred there may be more: wait again, `ppoll` returns at once.
    ///
    /// # Errors
    /// [`BusFault`], once for each time the interface goes down; receiving goes on when it is up again, or there again.
    pub fn receive(&mut self, mut take: impl FnMut(Arrival)) -> Result<usize, BusFault> {
        if self.is_gone {
            // Without success there is still the socket's error to be taken, which would wake the caller again and again.
            self.rejoin();
        }
        let (mut total, mut has_foreign, mut echoed) = (0, false, 0);
        while total < MOST {
            let given_ns = self.given_ns.take();
            let mut is_given = given_ns.is_some();
            // Never back: what was handed over must not have come after now.
            self.looked_ns = given_ns.unwrap_or_else(clock::monotonic_ns).max(self.looked_ns);
            let asked_ns = self.looked_ns;
            let mut realtime_ns = match self.stamps.realtime(self.looked_ns) {
                Some(realtime_ns) => realtime_ns,
                None => self.compare_clocks(self.looked_ns),
            };
            let Self { socket, batch, stamps, counts, last_dropped, echoes, looked_ns, .. } = self;
            let each = |raw: RawArrival| {
                if raw.control.software_ns > realtime_ns && std::mem::take(&mut is_given) {
                    // It came after the given time: by its own stamp, if that is a moment, else by the clock.
                    let later_ns = raw.control.software_ns - realtime_ns;
                    let now_ns = if later_ns <= THRESHOLDS.early_ns {
                        *looked_ns + later_ns
                    } else {
                        clock::monotonic_ns().max(*looked_ns)
                    };
                    realtime_ns = realtime_ns.wrapping_add(now_ns - *looked_ns);
                    *looked_ns = now_ns;
                }
                let software_ns = stamps.software(raw.control.software_ns, *looked_ns, realtime_ns);
                if let Some(dropped) = raw.control.dropped {
                    counts.dropped += u64::from(dropped.wrapping_sub(*last_dropped));
                    *last_dropped = dropped;
                }
                if let Some(echoes) = echoes {
                    echoes.learn(&raw);
                }
                if let Some(arrival) = sort(&raw, stamps, counts, software_ns) {
                    let is_echo = matches!(arrival, Arrival::Echo { .. });
                    echoed += usize::from(is_echo);
                    has_foreign |= !is_echo;
                    take(arrival);
                }
            };
            let fd = socket.as_raw_fd();
            let (room, received) = if total == 0 {
                (FEW, batch.receive::<FEW>(fd, each))
            } else {
                (BATCH, batch.receive::<BATCH>(fd, each))
            };
            let received = received.map_err(|error| self.fault(&error))?;
            total += received;
            if received < room {
                self.stamps.empty_ns = asked_ns;
                break;
            }
        }
        self.awaited.seen(echoed);
        // Here nobody waits for an answer, as one may where there was a frame.
        if !has_foreign && self.stamps.is_distance_old(self.looked_ns) {
            self.compare_clocks(self.looked_ns);
        }
        Ok(total)
    }

    /// Measures how far the two clocks are apart; [ns] CLOCK_REALTIME at `monotonic_ns`, a moment ago.
    fn compare_clocks(&mut self, monotonic_ns: u64) -> u64 {
        self.stamps.measure(clock::monotonic_ns, clock::realtime_ns);
        // Just measured, so it is there.
        self.stamps.realtime(monotonic_ns).unwrap_or(0)
    }

    /// [ns] most that the stamp of a frame that came at about `stamp_ns` is off where the kernel stamps: as long as one
    /// clock is not read against the other at once, and they drift. 0 before the first call of [`Port::receive`].
    #[must_use]
    pub fn stamp_uncertainty_ns(&self, stamp_ns: u64) -> u64 {
        self.stamps.uncertainty_ns(stamp_ns).unwrap_or(0)
    }

    /// Sends a frame now, or drops it.
    ///
    /// # Errors
    /// [`BusFault`]: the frame is dropped and counted. The next one, newer, is the retry.
    pub fn send(&mut self, frame: &Frame) -> Result<(), BusFault> {
        self.send_all(std::slice::from_ref(frame)).1.map_or(Ok(()), Err)
    }

    /// Sends frames, as [`Port::send`] does one by one; [ns] when all were out or dropped, and the first fault.
    pub fn send_all(&mut self, frames: &[Frame]) -> (u64, Option<BusFault>) {
        let (given, now_ns, fault) = give_each(frames, |frame| self.give(frame));
        if !frames.is_empty() {
            self.awaited.sent(given, now_ns);
        }
        (now_ns, fault)
    }

    fn give(&mut self, frame: &Frame) -> Result<(), BusFault> {
        match socket::send(self.socket.as_raw_fd(), frame) {
            Ok(()) => {
                self.counts.sent += 1;
                Ok(())
            }
            Err(error) => {
                let fault = self.fault(&error);
                self.counts.refuse(fault);
                Err(fault)
            }
        }
    }

    fn fault(&mut self, error: &io::Error) -> BusFault {
        let fault = BusFault::of(error);
        if fault == BusFault::Gone && !self.is_gone {
            self.is_gone = true;
            self.watch.look_for();
        }
        fault
    }

    /// Joins the interface of the same name, once there is one again that is as this one was: an adapter that was unplugged
    /// comes back as a new interface. Two short system calls a socket then, none before; neither waits nor allocates.
    fn rejoin(&mut self) {
        let Some(index) = self.watch.found() else { return };
        let index = index as libc::c_int;
        let own = socket::bind_again(self.socket.as_raw_fd(), index, &[EVERYTHING]);
        if own.and_then(|()| self.echoes.as_ref().map_or(Ok(()), |it| it.bind_again(index))).is_err() {
            // Gone again meanwhile.
            self.watch.look_for();
            return;
        }
        self.is_gone = false;
        self.counts.rejoined += 1;
        // Another adapter, another clock; what the queue still holds is no younger for it.
        self.stamps = StampClock::new(self.stamps.empty_ns);
    }

    /// Asks how the interface is, which another thread finds out; neither waits nor allocates.
    pub fn ask(&self) {
        self.watch.ask();
    }

    /// What was found, since [`Port::ask`] or since the interface was gone; [`None`] when nothing is new.
    #[must_use]
    pub fn answer(&self) -> Option<InterfaceAnswer> {
        self.watch.answer()
    }

    /// Takes in the echoes of what was sent, where they are apart: what has not been listened for counts as not seen. Neither
    /// waits nor allocates; one system call as a rule, none where they are not apart.
    ///
    /// Now and then it compares the clocks, too: here, after the commands, nobody waits for it, as the next frame's answer would.
    pub fn listen(&mut self) {
        if self.stamps.is_distance_old(self.looked_ns) {
            self.compare_clocks(self.looked_ns);
        }
        let Some(echoes) = &mut self.echoes else { return };
        let (echoed, lost) = echoes.listen(&mut self.batch);
        self.counts.echoed += echoed as u64;
        self.counts.echoes_dropped += lost;
        self.awaited.seen(echoed);
    }

    /// [ns] since the first attempt to send whose echo was not seen; 0 when all were.
    /// A few periods: a stall. Many: the bus is dead, even where nothing else says so.
    #[must_use]
    pub fn echo_age_ns(&self, now_ns: u64) -> u64 {
        self.awaited.since_ns().map_or(0, |since| now_ns.saturating_sub(since))
    }

    /// Totals since it was opened.
    #[must_use]
    pub fn counts(&self) -> PortCounts {
        self.counts
    }
}

/// Readable when something arrived: for `ppoll`.
impl AsRawFd for Port {
    fn as_raw_fd(&self) -> RawFd {
        self.socket.as_raw_fd()
    }
}

impl fmt::Debug for Port {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Port").field("socket", &self.socket).field("counts", &self.counts).finish()
    }
}

/// Whether this kernel has CAN at all.
#[must_use]
pub fn kernel_has_can() -> bool {
    // An interface index no machine has: a kernel with CAN answers "no such device".
    match CanSocket::open_iface(u32::MAX >> 1) {
        Ok(_) => true,
        Err(error) => !matches!(error.raw_os_error(), Some(libc::EAFNOSUPPORT | libc::EPROTONOSUPPORT)),
    }
}

fn sort(
    raw: &RawArrival,
    stamps: &mut StampClock,
    counts: &mut PortCounts,
    software_ns: u64,
) -> Option<Arrival> {
    if raw.id & libc::CAN_ERR_FLAG != 0 {
        counts.errors += 1;
        let error = ErrorFrame { class: raw.id & libc::CAN_ERR_MASK, data: raw.data };
        return Some(Arrival::Error { error, stamp_ns: software_ns });
    }
    let frame = raw.frame?;
    if raw.own {
        counts.echoed += 1;
        return Some(Arrival::Echo { frame, stamp_ns: software_ns });
    }
    counts.received += 1;
    let hardware_ns = (raw.control.hardware_ns != 0).then_some(raw.control.hardware_ns);
    let stamp_ns = hardware_ns.map_or(software_ns, |stamp| stamps.hardware(stamp, software_ns));
    Some(Arrival::Frame { frame, stamp_ns, hardware_ns })
}
