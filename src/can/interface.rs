//! The state of an interface, asked of the kernel by netlink: a round trip, so never in the cycle.

use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;

use crossbeam::channel::{Sender, bounded};
use crossbeam::queue::ArrayQueue;
use socketcan::CanInterface;
use socketcan::nl::{CanState, Mtu};

use super::error::CanError;

/// Where the kernel lists its network interfaces.
pub(super) const INTERFACES: &str = "/sys/class/net";

/// What the kernel says of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InterfaceStatus {
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
        let fail = |reason: String| CanError::Interface { interface: interface.to_owned(), reason };
        let listed = Path::new(INTERFACES);
        // Asked by a name that it does not know, the kernel would start a program to look for a driver.
        if listed.exists() && !listed.join(interface).exists() {
            return Err(fail(missing(interface)));
        }
        let details = CanInterface::open(interface)
            .map_err(|_| fail(missing(interface)))?
            .details()
            .map_err(|error| fail(format!("its state cannot be read: {error}")))?;
        let can = details.can;
        Ok(Self {
            is_up: details.is_up,
            fd: details.mtu == Some(Mtu::Fd),
            state: can.state,
            restart_ms: can.restart_ms,
            bit_rate: can.bit_timing.map(|timing| timing.bitrate),
            data_bit_rate: can.data_bit_timing.map(|timing| timing.bitrate),
            error_counters: can.berr_counter.map(|counter| (counter.txerr, counter.rxerr)),
        })
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

/// Reads the state of an interface on a thread of its own, whenever the cycle asks.
#[derive(Debug)]
pub struct InterfaceWatch {
    ask: Option<Sender<()>>,
    answers: Arc<ArrayQueue<InterfaceStatus>>,
    thread: Option<JoinHandle<()>>,
}

impl InterfaceWatch {
    /// Starts the thread.
    ///
    /// # Errors
    /// [`CanError::Socket`] when the operating system gives no thread.
    pub fn start(interface: &str) -> Result<Self, CanError> {
        let (ask, asked) = bounded::<()>(1);
        let answers = Arc::new(ArrayQueue::new(4));
        let (queue, name) = (Arc::clone(&answers), interface.to_owned());
        let thread = std::thread::Builder::new()
            .name("can-interface".to_owned())
            .spawn(move || {
                while asked.recv().is_ok() {
                    if let Ok(status) = InterfaceStatus::read(&name) {
                        queue.force_push(status);
                    }
                }
            })
            .map_err(|source| CanError::Socket {
                interface: interface.to_owned(),
                action: "cannot start the thread that watches it",
                source,
            })?;
        Ok(Self { ask: Some(ask), answers, thread: Some(thread) })
    }

    /// Asks for the state; neither waits nor allocates. While a question is open, another one is the same one.
    pub fn ask(&self) {
        if let Some(ask) = &self.ask {
            // Full = already asked.
            let _ = ask.try_send(());
        }
    }

    /// The next answer, if there is one.
    #[must_use]
    pub fn answer(&self) -> Option<InterfaceStatus> {
        self.answers.pop()
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
