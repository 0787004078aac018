//! The state of an interface, asked of the kernel by netlink: a round trip, so never in the cycle.

use super::thresholds::THRESHOLDS;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use crossbeam::queue::ArrayQueue;
use socketcan::CanInterface;
use socketcan::nl::{CanState, Mtu};

use super::error::CanError;

/// Where the kernel lists its network interfaces.
const INTERFACES: &str = "/sys/class/net";
/// The kind that a CAN interface has there (`ARPHRD_CAN`).
const CAN: &str = "280";

/// What the kernel says of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InterfaceStatus {
    /// Its number, which another interface of the same name does not have.
    pub index: u32,
    /// Whether it is up.
    pub is_up: bool,
    /// Whether it carries CAN FD frames.
    pub fd: bool,
    /// State of the controller; `None` for a virtual interface.
    pub state: Option<CanState>,
    /// [ms] after which the controller restarts itself from bus off; 0 = it stays off.
    pub restart_ms: Option<u32>,
    /// [bit/s] of the arbitration phase.
    pub bit_rate: Option<u32>,
    /// [bit/s] of the data phase.
    pub data_bit_rate: Option<u32>,
    /// Transmit and receive error counters.
    pub error_counters: Option<(u16, u16)>,
}

impl InterfaceStatus {
    /// Asks the kernel.
    ///
    /// # Errors
    /// [`CanError::Interface`] when there is no such interface, with the command that makes one.
    pub fn read(interface: &str) -> Result<Self, CanError> {
        let missing = || CanError::Interface { interface: interface.to_owned(), reason: missing(interface) };
        Self::find(interface)?.ok_or_else(missing)
    }

    /// Asks the kernel; `None` when there is no such interface.
    ///
    /// # Errors
    /// [`CanError::Interface`] when it is there and does not say what it is.
    pub fn find(interface: &str) -> Result<Option<Self>, CanError> {
        let listed = Path::new(INTERFACES);
        // Asked by a name that it does not know, the kernel would start a program to look for a driver.
        if listed.exists() && !listed.join(interface).exists() {
            return Ok(None);
        }
        if let Some(kind) =
            fs::read_to_string(listed.join(interface).join("type")).ok().filter(|it| it.trim() != CAN)
        {
            let reason = format!(
                "it is there, and no CAN interface: the kernel calls it a network device of kind {}, and CAN is {CAN}",
                kind.trim()
            );
            return Err(CanError::Interface { interface: interface.to_owned(), reason });
        }
        let Ok(found) = CanInterface::open(interface) else { return Ok(None) };
        let details = found.details().map_err(|error| CanError::Interface {
            interface: interface.to_owned(),
            reason: format!("its state cannot be read: {error}"),
        })?;
        let can = details.can;
        Ok(Some(Self {
            index: details.index,
            is_up: details.is_up,
            fd: details.mtu == Some(Mtu::Fd),
            state: can.state,
            restart_ms: can.restart_ms,
            bit_rate: can.bit_timing.map(|timing| timing.bitrate),
            data_bit_rate: can.data_bit_timing.map(|timing| timing.bitrate),
            error_counters: can.berr_counter.map(|counter| (counter.txerr, counter.rxerr)),
        }))
    }

    /// Whether it carries what it carried when it was `opened`, at the same speed. On a bus one node with another bit rate
    /// destroys the frames of all others.
    fn is_as(&self, opened: &Self) -> bool {
        let fd = self.fd || !opened.fd;
        fd && (self.bit_rate, self.data_bit_rate) == (opened.bit_rate, opened.data_bit_rate)
    }
}

/// Says that an interface is missing, and what mends it.
fn missing(interface: &str) -> String {
    let mend = if interface.starts_with("vcan") {
        format!("sudo ip link add dev {interface} type vcan && sudo ip link set {interface} up")
    } else {
        format!("plug the adapter in; sudo ip link set {interface} up type can bitrate 1000000")
    };
    format!("there is none of that name ({mend})")
}

/// What was found at an interface that was asked about, or looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InterfaceAnswer {
    /// Its state now.
    pub status: InterfaceStatus,
    /// See [`InterfaceStatus::is_as`]: as it was when the port was opened. While it is not, a port that lost it does not
    /// join it again.
    pub is_as_opened: bool,
}

/// Reads the state of an interface on a thread of its own, whenever the cycle asks; and looks for it when it is gone.
#[derive(Debug)]
pub(super) struct InterfaceWatch {
    ask: Option<Sender<()>>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    answers: ArrayQueue<InterfaceAnswer>,
    is_lost: AtomicBool,
    /// Number of the interface that was looked for and found; 0 = none.
    found: AtomicU32,
}

impl InterfaceWatch {
    /// Starts the thread, for an interface that is like `opened` now.
    ///
    /// # Errors
    /// [`CanError::Socket`] when the operating system gives no thread.
    pub(super) fn start(interface: &str, opened: InterfaceStatus) -> Result<Self, CanError> {
        let (ask, asked) = bounded::<()>(1);
        let shared = Arc::new(Shared {
            answers: ArrayQueue::new(4),
            is_lost: AtomicBool::new(false),
            found: AtomicU32::new(0),
        });
        let (name, theirs) = (interface.to_owned(), Arc::clone(&shared));
        let thread = std::thread::Builder::new()
            .name("can-interface".to_owned())
            .spawn(move || theirs.watch(&name, &opened, &asked))
            .map_err(|source| CanError::Socket {
                interface: interface.to_owned(),
                action: "cannot start the thread that watches it",
                source,
            })?;
        Ok(Self { ask: Some(ask), shared, thread: Some(thread) })
    }

    /// Asks for the state; neither waits nor allocates. While a question is open, another one is the same one.
    pub(super) fn ask(&self) {
        if let Some(ask) = &self.ask {
            // Full = already asked.
            let _ = ask.try_send(());
        }
    }

    /// Has an interface of the same name looked for until one is up that is as this one was; neither waits nor allocates.
    pub(super) fn look_for(&self) {
        self.shared.found.store(0, Ordering::Relaxed);
        self.shared.is_lost.store(true, Ordering::Release);
        self.ask();
    }

    /// Number of the interface that was looked for, once it is there.
    pub(super) fn found(&self) -> Option<u32> {
        Some(self.shared.found.load(Ordering::Acquire)).filter(|index| *index != 0)
    }

    /// The next answer, if there is one.
    pub(super) fn answer(&self) -> Option<InterfaceAnswer> {
        self.shared.answers.pop()
    }
}

impl Shared {
    /// Until nobody can ask any more.
    fn watch(&self, interface: &str, opened: &InterfaceStatus, asked: &Receiver<()>) {
        // What was reported last of an interface that is looked for: not twenty times a second.
        let mut reported = None;
        loop {
            let is_lost = self.is_lost.load(Ordering::Acquire);
            let is_asked = match if is_lost {
                asked.recv_timeout(Duration::from_nanos(THRESHOLDS.interface_look_ns))
            } else {
                asked.recv().map_err(Into::into)
            } {
                Ok(()) => true,
                Err(RecvTimeoutError::Timeout) => false,
                Err(RecvTimeoutError::Disconnected) => return,
            };
            let Ok(status) = InterfaceStatus::read(interface) else { continue };
            let is_as_opened = status.is_as(opened);
            if status.is_up && is_as_opened && self.is_lost.swap(false, Ordering::AcqRel) {
                self.found.store(status.index, Ordering::Release);
            }
            let news = Some((status.is_up, is_as_opened));
            if is_asked || reported != news {
                self.answers.force_push(InterfaceAnswer { status, is_as_opened });
            }
            reported = news;
        }
    }
}

impl Drop for InterfaceWatch {
    fn drop(&mut self) {
        self.ask = None;
        if let Some(thread) = self.thread.take() {
            // A panic of that thread has been reported by itself.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interface_with_another_bit_rate_is_another() {
        let opened = InterfaceStatus {
            index: 3,
            is_up: true,
            fd: true,
            state: None,
            restart_ms: Some(100),
            bit_rate: Some(1_000_000),
            data_bit_rate: Some(4_000_000),
            error_counters: None,
        };
        // Its number, its state, and how it restarts are its own affair.
        let back = InterfaceStatus { index: 9, restart_ms: None, error_counters: Some((1, 2)), ..opened };
        assert!(back.is_as(&opened));
        assert!(!InterfaceStatus { bit_rate: Some(500_000), ..back }.is_as(&opened));
        assert!(!InterfaceStatus { bit_rate: None, ..back }.is_as(&opened));
        assert!(!InterfaceStatus { data_bit_rate: Some(2_000_000), ..back }.is_as(&opened));
        assert!(!InterfaceStatus { fd: false, ..back }.is_as(&opened));
        let classic = InterfaceStatus { fd: false, ..opened };
        assert!(back.is_as(&classic), "it carries more than it must");
    }
}
