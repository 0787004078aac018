//! What a loop needs of a bus, whatever carries it: frames in, frames out, and what became of them.

use std::fmt;
use std::io;

use super::error_frame::ErrorFrame;
use super::frame::Frame;
use super::interface::InterfaceAnswer;
use crate::clock;

/// What arrived.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// A frame of another sender.
    Frame {
        /// The frame.
        frame: Frame,
        /// [ns] CLOCK_MONOTONIC of its arrival, by the adapter's clock where it stamps, else by the kernel's.
        stamp_ns: u64,
        /// [ns] the adapter's own stamp, in its own time.
        hardware_ns: Option<u64>,
    },
    /// A frame this port sent has been on the bus.
    Echo {
        /// The frame.
        frame: Frame,
        /// [ns] CLOCK_MONOTONIC.
        stamp_ns: u64,
    },
    /// The controller reports an error.
    Error {
        /// What it says.
        error: ErrorFrame,
        /// [ns] CLOCK_MONOTONIC.
        stamp_ns: u64,
    },
}

/// Why nothing was sent or received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusFault {
    /// The interface has no room: the bus is busy, or dead. The frame is dropped.
    Full,
    /// The interface is down.
    Down,
    /// The interface is gone from the machine. Should there be one of its name again, up, with the same bit rates, the port
    /// joins it.
    Gone,
    /// Another error number of the operating system.
    Other(i32),
}

/// Totals of a port since it was opened.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct PortCounts {
    /// Frames of other senders received.
    pub received: u64,
    /// Frames lost because this process did not take them in time (`SO_RXQ_OVFL`).
    pub dropped: u64,
    /// Error frames.
    pub errors: u64,
    /// Frames given to the interface.
    pub sent: u64,
    /// Frames of ours that have been on the bus.
    pub echoed: u64,
    /// Echoes lost because this process did not listen in time.
    pub echoes_dropped: u64,
    /// Frames dropped because the interface had no room.
    pub full: u64,
    /// Frames dropped because the interface was down or gone.
    pub down: u64,
    /// Frames dropped for another reason.
    pub failed: u64,
    /// Times that the interface was gone from the machine, and joined when it was there again.
    pub rejoined: u64,
    /// Datagrams that carry no frame of this bus: damaged, foreign, or CAN FD on a classical bus. Of UDP multicast only.
    pub malformed: u64,
}

impl PortCounts {
    /// Counts a frame that was not sent, by its cause.
    pub(super) fn refuse(&mut self, fault: BusFault) {
        *match fault {
            BusFault::Full => &mut self.full,
            BusFault::Down | BusFault::Gone => &mut self.down,
            BusFault::Other(_) => &mut self.failed,
        } += 1;
    }
}

/// What a loop needs of a bus: a [`super::BusPort`], or, on virtual time, a bus in memory.
pub trait Bus {
    /// See [`super::Port::receive`].
    ///
    /// # Errors
    /// [`BusFault`], once for each time the interface goes down.
    fn receive(&mut self, take: impl FnMut(Arrival)) -> Result<usize, BusFault>;

    /// See [`super::Port::send`].
    ///
    /// # Errors
    /// [`BusFault`]: the frame is dropped and counted.
    fn send(&mut self, frame: &Frame) -> Result<(), BusFault>;

    /// Sends frames, as one by one; [ns] when all were out or dropped. The first fault, should there be one.
    fn send_all(&mut self, frames: &[Frame]) -> (u64, Option<BusFault>) {
        let fault = frames.iter().fold(None, |fault, frame| fault.or(self.send(frame).err()));
        (self.now_ns(), fault)
    }

    /// See [`super::Port::listen`]; where echoes come with [`Bus::receive`] there is nothing to do.
    fn listen(&mut self) {}

    /// See [`super::Port::echo_age_ns`].
    fn echo_age_ns(&self, now_ns: u64) -> u64;

    /// See [`super::Port::counts`].
    fn counts(&self) -> PortCounts;

    /// [ns] now, on the clock of the arrivals' stamps.
    fn now_ns(&self) -> u64;

    /// Says what time it was a moment ago [ns]: the next [`Bus::receive`] need not ask the clock, unless something came
    /// since. Saves a reading of it on the way from frame to frame.
    fn look_at(&mut self, _now_ns: u64) {}

    /// [ns] when [`Bus::receive`] looked last: no arrival that it handed over is later. Saves another.
    fn looked_ns(&self) -> u64 {
        self.now_ns()
    }

    /// See [`super::Port::ask`]; nobody watches a bus in memory.
    fn ask(&self) {}

    /// See [`super::Port::answer`].
    fn answer(&self) -> Option<InterfaceAnswer> {
        None
    }

    /// Whether the interface is gone: each [`Bus::receive`] then tries to join the one that has its name now.
    fn is_gone(&self) -> bool {
        false
    }
}

impl BusFault {
    /// What an error of the operating system means for a frame.
    pub(super) fn of(error: &io::Error) -> Self {
        match error.raw_os_error().unwrap_or(0) {
            libc::ENOBUFS | libc::EAGAIN => Self::Full,
            libc::ENETDOWN | libc::ENETUNREACH => Self::Down,
            libc::ENXIO | libc::ENODEV => Self::Gone,
            number => Self::Other(number),
        }
    }
}

impl fmt::Display for BusFault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Full => formatter.write_str("the interface has no room for a frame"),
            Self::Down => formatter.write_str("the interface is down"),
            Self::Gone => formatter.write_str("the interface is gone"),
            Self::Other(number) => io::Error::from_raw_os_error(*number).fmt(formatter),
        }
    }
}

/// Gives each of these frames to what carries them: how many it took, [ns] when all were out or dropped, and the first fault.
pub(super) fn give_each(
    frames: &[Frame],
    mut give: impl FnMut(&Frame) -> Result<(), BusFault>,
) -> (usize, u64, Option<BusFault>) {
    let (mut given, mut first) = (0, None);
    for frame in frames {
        match give(frame) {
            Ok(()) => given += 1,
            Err(fault) => first = first.or(Some(fault)),
        }
    }
    // The clock is read when the frames are out already, once for all that needs to know when that was.
    (given, clock::monotonic_ns(), first)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bus that refuses every second frame, and says nothing of what it need not.
    #[derive(Default)]
    struct Refusing {
        sent: u64,
    }

    impl Bus for Refusing {
        fn receive(&mut self, _: impl FnMut(Arrival)) -> Result<usize, BusFault> {
            Ok(0)
        }

        fn send(&mut self, _: &Frame) -> Result<(), BusFault> {
            self.sent += 1;
            match self.sent {
                2 => Err(BusFault::Full),
                4 => Err(BusFault::Down),
                _ => Ok(()),
            }
        }

        fn echo_age_ns(&self, _: u64) -> u64 {
            0
        }

        fn counts(&self) -> PortCounts {
            PortCounts::default()
        }

        fn now_ns(&self) -> u64 {
            1_000 + self.sent
        }
    }

    #[test]
    fn frames_go_out_one_by_one_and_the_first_fault_is_told() {
        let mut bus = Refusing::default();
        assert_eq!(bus.send_all(&[Frame::EMPTY]), (1_001, None));
        assert_eq!(bus.send_all(&[Frame::EMPTY; 4]), (1_005, Some(BusFault::Full)), "each was tried");
        assert_eq!(bus.looked_ns(), bus.now_ns());
        assert!(!bus.is_gone() && bus.answer().is_none());
    }

    #[test]
    fn a_fault_says_what_it_is() {
        let said = |number| BusFault::of(&io::Error::from_raw_os_error(number)).to_string();
        assert_eq!(said(libc::ENOBUFS), "the interface has no room for a frame");
        assert_eq!(said(libc::ENETDOWN), "the interface is down");
        assert_eq!(said(libc::ENODEV), "the interface is gone");
        assert!(said(libc::EPERM).contains("not permitted"), "{}", said(libc::EPERM));
    }
}
