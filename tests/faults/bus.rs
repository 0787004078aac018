//! A CAN bus in memory, on virtual time: what the bridge's port is to it in lockstep.

use std::cell::RefCell;
use std::rc::Rc;

use rotorbench::can::{Arrival, Bus, BusFault, ErrorFrame, Frame, PortCounts};

/// State of the bridge's interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interface {
    Up,
    /// Every send finds no room: ENOBUFS.
    Full,
    Down,
    Gone,
    /// The controller has left the bus: it takes a handful of frames and sends none.
    Off,
}

/// Frames that a socket takes before it says that it is full: the kernel's least send buffer.
const ROOM: u32 = 7;

#[derive(Debug)]
struct Inner {
    now_ns: u64,
    interface: Interface,
    has_said_down: bool,
    arrivals: Vec<(u64, Arrival)>,
    sent: Vec<Frame>,
    queued: u32,
    waiting_since_ns: Option<u64>,
    counts: PortCounts,
}

/// The bus; its clones are the same bus.
#[derive(Debug, Clone)]
pub struct MemoryBus(Rc<RefCell<Inner>>);

impl MemoryBus {
    pub fn new() -> Self {
        Self(Rc::new(RefCell::new(Inner {
            now_ns: 0,
            interface: Interface::Up,
            has_said_down: false,
            arrivals: Vec::new(),
            sent: Vec::new(),
            queued: 0,
            waiting_since_ns: None,
            counts: PortCounts::default(),
        })))
    }

    pub fn advance(&self, now_ns: u64) {
        self.0.borrow_mut().now_ns = now_ns;
    }

    pub fn set(&self, interface: Interface) {
        let mut inner = self.0.borrow_mut();
        if inner.interface == Interface::Gone && interface == Interface::Up {
            inner.counts.rejoined += 1;
        }
        inner.interface = interface;
        if interface == Interface::Up {
            inner.has_said_down = false;
            inner.queued = 0;
        }
    }

    /// A frame of another node reaches the bridge at `due_ns`.
    pub fn carry(&self, due_ns: u64, frame: Frame) {
        let arrival = Arrival::Frame { frame, stamp_ns: due_ns, hardware_ns: None };
        self.0.borrow_mut().arrivals.push((due_ns, arrival));
    }

    /// The bridge's controller says what is wrong.
    pub fn complain(&self, class: u32, data: [u8; 8]) {
        let mut inner = self.0.borrow_mut();
        let stamp_ns = inner.now_ns;
        let arrival = Arrival::Error { error: ErrorFrame { class, data }, stamp_ns };
        inner.arrivals.push((stamp_ns, arrival));
    }

    /// Frames of the bridge that were on the bus since the last call.
    pub fn take_sent(&self) -> Vec<Frame> {
        std::mem::take(&mut self.0.borrow_mut().sent)
    }

    /// The bridge's process died: its socket and all that waited in it are gone.
    pub fn forget(&self) {
        let mut inner = self.0.borrow_mut();
        inner.sent.clear();
        inner.arrivals.clear();
        inner.waiting_since_ns = None;
        inner.queued = 0;
    }
}

impl Bus for MemoryBus {
    fn receive(&mut self, mut take: impl FnMut(Arrival)) -> Result<usize, BusFault> {
        let mut inner = self.0.borrow_mut();
        let now_ns = inner.now_ns;
        if matches!(inner.interface, Interface::Down | Interface::Gone) {
            // What is sent meanwhile is on no wire of ours.
            inner.arrivals.clear();
            return if std::mem::replace(&mut inner.has_said_down, true) {
                Ok(0)
            } else {
                Err(BusFault::Down)
            };
        }
        let (mut due, later): (Vec<_>, Vec<_>) =
            std::mem::take(&mut inner.arrivals).into_iter().partition(|(due_ns, _)| *due_ns <= now_ns);
        inner.arrivals = later;
        // Stable: frames of one instant in the order of their sending.
        due.sort_by_key(|(due_ns, _)| *due_ns);
        for (_, arrival) in &due {
            match arrival {
                Arrival::Frame { .. } => inner.counts.received += 1,
                Arrival::Echo { .. } => {
                    inner.counts.echoed += 1;
                    inner.waiting_since_ns = None;
                }
                Arrival::Error { .. } => inner.counts.errors += 1,
            }
        }
        drop(inner);
        let count = due.len();
        due.into_iter().for_each(|(_, arrival)| take(arrival));
        Ok(count)
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusFault> {
        let mut inner = self.0.borrow_mut();
        let now_ns = inner.now_ns;
        inner.waiting_since_ns.get_or_insert(now_ns);
        let fault = match inner.interface {
            Interface::Up => {
                inner.sent.push(*frame);
                inner.arrivals.push((now_ns, Arrival::Echo { frame: *frame, stamp_ns: now_ns }));
                None
            }
            Interface::Off if inner.queued < ROOM => {
                inner.queued += 1;
                None
            }
            Interface::Off | Interface::Full => Some(BusFault::Full),
            Interface::Down => Some(BusFault::Down),
            Interface::Gone => Some(BusFault::Gone),
        };
        let Some(fault) = fault else {
            inner.counts.sent += 1;
            return Ok(());
        };
        match fault {
            BusFault::Full => inner.counts.full += 1,
            _ => inner.counts.down += 1,
        }
        Err(fault)
    }

    fn echo_age_ns(&self, now_ns: u64) -> u64 {
        self.0.borrow().waiting_since_ns.map_or(0, |since| now_ns.saturating_sub(since))
    }

    fn counts(&self) -> PortCounts {
        self.0.borrow().counts
    }

    fn now_ns(&self) -> u64 {
        self.0.borrow().now_ns
    }
}
