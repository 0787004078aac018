//! The echo of what a port sends: it distinguishes a live bus from a dead one where nothing else does.
//!
//! Nobody acts on an echo, so a port whose frames have a few identifiers only can have theirs on a socket of its own, which
//! wakes nobody and is listened to every few periods. The port's other socket then gets no echo, and what it gets with one of
//! these identifiers is another sender's, at once.

use std::collections::VecDeque;
use std::fmt;
use std::io;
use std::os::fd::AsRawFd;

use socketcan::{CanFilter, CanSocket, Socket, SocketOptions};

use super::protocol::IdFilter;
use super::socket::{self, BATCH, Batch, RawArrival};

/// Frames that wait for their echo at once, as far as their times are kept.
const MOST: usize = 64;
/// Batches that one [`EchoSocket::listen`] takes: more than the socket's buffer holds.
const BATCHES: usize = 32;

/// The frames whose echo has not been seen yet, in the order of their sending, which is that of their echoes.
#[derive(Debug)]
pub(super) struct Awaited {
    sent_ns: VecDeque<u64>,
    /// How many of them were there already when echoes were seen last.
    old: usize,
}

impl Awaited {
    pub(super) fn new() -> Self {
        Self { sent_ns: VecDeque::with_capacity(MOST), old: 0 }
    }

    /// That many frames were sent at `now_ns`. None = the interface took none: that attempt waits, too, because on a dead bus no
    /// other frame ever finds room. Never allocates; of very many the first are known.
    pub(super) fn sent(&mut self, frames: usize, now_ns: u64) {
        let room = MOST - self.sent_ns.len();
        let least = usize::from(self.sent_ns.is_empty());
        self.sent_ns.extend(std::iter::repeat_n(now_ns, frames.max(least).min(room)));
    }

    /// That many echoes were seen. What was sent before the ones seen earlier and is missing still is lost: later frames have
    /// been on the bus.
    pub(super) fn seen(&mut self, echoes: usize) {
        if echoes > 0 {
            let known = (self.old + echoes).min(self.sent_ns.len());
            self.sent_ns.drain(..known);
            self.old = self.sent_ns.len();
        }
    }

    /// [ns] when the first of them was sent.
    pub(super) fn since_ns(&self) -> Option<u64> {
        self.sent_ns.front().copied()
    }
}

/// Hears frames with certain identifiers, and which of them this machine sent.
pub(super) struct EchoSocket {
    socket: CanSocket,
    filters: Vec<libc::can_filter>,
    /// Frames of other senders on this machine, which the port's other socket has got, and this one not yet.
    foreign: usize,
    last_dropped: u32,
}

/// Every bit in which the identifiers of two data frames can differ. The one of error frames has a meaning of its own in a
/// filter: it asks for them alone.
const EXACTLY: u32 = libc::CAN_EFF_FLAG | libc::CAN_RTR_FLAG | libc::CAN_EFF_MASK;

impl EchoSocket {
    pub(super) fn open(interface: &str, fd: bool, own: &[IdFilter]) -> io::Result<Self> {
        let filter = |own: &IdFilter| {
            let can_mask = EXACTLY & (own.bits | !libc::CAN_EFF_MASK);
            libc::can_filter { can_id: socket::raw_id(own.id) & can_mask, can_mask }
        };
        let filters: Vec<libc::can_filter> = own.iter().map(filter).collect();
        let socket = CanSocket::open(interface)?;
        socket.set_nonblocking(true)?;
        socket.set_socket_option_int(libc::SOL_CAN_RAW, libc::CAN_RAW_FD_FRAMES, i32::from(fd))?;
        let wanted: Vec<CanFilter> =
            filters.iter().map(|it| CanFilter::new(it.can_id, it.can_mask)).collect();
        socket.set_filters(&wanted)?;
        socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_RXQ_OVFL, 1)?;
        Ok(Self { socket, filters, foreign: 0, last_dropped: 0 })
    }

    /// See [`socket::bind_again`].
    pub(super) fn bind_again(&self, index: libc::c_int) -> io::Result<()> {
        socket::bind_again(self.socket.as_raw_fd(), index, &self.filters)
    }

    /// Has to know every frame that the port's other socket gets: another sender on this machine looks as the port itself here.
    pub(super) fn learn(&mut self, raw: &RawArrival) {
        if raw.is_local && self.filters.iter().any(|filter| filter.can_id == raw.id & filter.can_mask) {
            self.foreign += 1;
        }
    }

    /// Echoes of the port's frames since the last time, and frames lost for want of room.
    pub(super) fn listen(&mut self, batch: &mut Batch) -> (usize, u64) {
        let (mut local, mut lost) = (0, 0);
        for _ in 0..BATCHES {
            let last_dropped = &mut self.last_dropped;
            let taken = batch.receive::<BATCH>(self.socket.as_raw_fd(), |raw| {
                local += usize::from(raw.is_local);
                if let Some(dropped) = raw.control.dropped {
                    lost += u64::from(dropped.wrapping_sub(*last_dropped));
                    *last_dropped = dropped;
                }
            });
            // An interface that was down or gone is the other socket's to report; here it is said once, before what came since.
            if taken.is_ok_and(|taken| taken < BATCH) {
                break;
            }
        }
        let foreign = self.foreign.min(local);
        self.foreign -= foreign;
        (local - foreign, lost)
    }
}

impl fmt::Debug for EchoSocket {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("EchoSocket").field("socket", &self.socket).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_frame_without_an_echo_is_known() {
        let mut awaited = Awaited::new();
        assert_eq!(awaited.since_ns(), None);
        for now_ns in 1..=4 {
            awaited.sent(2, now_ns);
        }
        awaited.seen(0);
        assert_eq!(awaited.since_ns(), Some(1));
        awaited.seen(5);
        assert_eq!(awaited.since_ns(), Some(3), "one of the third pair");
        // The bus has died: nothing of this changes when it did.
        awaited.sent(2, 5);
        awaited.seen(0);
        awaited.sent(0, 6);
        assert_eq!(awaited.since_ns(), Some(3));
    }

    #[test]
    fn an_attempt_that_finds_no_room_waits_too() {
        let mut awaited = Awaited::new();
        awaited.sent(0, 7);
        awaited.sent(0, 8);
        assert_eq!(awaited.since_ns(), Some(7));
        awaited.sent(1, 9);
        awaited.seen(1);
        // The echo was that of the frame, but who knows; with the next one it is certain.
        assert_eq!(awaited.since_ns(), Some(9));
        awaited.sent(1, 10);
        awaited.seen(1);
        assert_eq!(awaited.since_ns(), None);
    }

    /// An adapter that tries each frame once loses some. They must not be waited for as if the bus were dead.
    #[test]
    fn what_is_missing_after_two_hearings_is_lost() {
        let mut awaited = Awaited::new();
        let mut oldest = 0;
        for now_ns in 1_u64..1_000 {
            awaited.sent(1, now_ns);
            // Listened to each fourth time, and each third frame lost.
            if now_ns.is_multiple_of(4) {
                awaited.seen((now_ns - 3..=now_ns).filter(|sent| !sent.is_multiple_of(3)).count());
            }
            oldest = oldest.max(awaited.since_ns().map_or(0, |since_ns| now_ns - since_ns));
        }
        assert_eq!(oldest, 4);
    }

    #[test]
    fn of_very_many_the_first_are_known() {
        let mut awaited = Awaited::new();
        for now_ns in 1..=1_000 {
            awaited.sent(3, now_ns);
        }
        assert_eq!((awaited.sent_ns.len(), awaited.sent_ns.capacity()), (MOST, MOST));
        assert_eq!(awaited.since_ns(), Some(1));
        awaited.seen(3_000);
        assert_eq!(awaited.since_ns(), None);
    }
}
