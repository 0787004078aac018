//! The bus half of a loop: frames to sensors, what the guard let through to frames, and whether the bus is alive.

use serde::Serialize;

use super::ProcessError;
use crate::bench::BenchConfig;
use crate::can::{Arrival, Bus, Counts, Fault, InterfaceStatus, InterfaceWatch, Port, PortCounts};
use crate::can::{ReceiverState, Roles, SenderState, SensorField};
use crate::rt::{LogQueue, Severity};
use crate::signal::{Applied, Sensors};
use std::os::fd::{AsRawFd, RawFd};

/// The bus, its codec, and the newest value of everything measured.
#[derive(Debug)]
pub struct Wire<B: Bus = Port> {
    port: B,
    roles: Roles,
    receiver: ReceiverState,
    sender: SenderState,
    /// `None` where there is no interface to watch: on a bus in memory.
    watch: Option<InterfaceWatch>,
    log: LogQueue,
    sensors: Sensors,
    /// Command frames in a row that the interface did not take.
    refused_in_a_row: u32,
    /// The descriptor was ready and gave nothing: not waited for until the next slot.
    is_quiet: bool,
}

/// What a look at the bus brought.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Look {
    /// A sensor has a new value.
    pub updated: bool,
    /// The gyro has.
    pub gyro: bool,
    /// The controller says that it left the bus.
    pub bus_off: bool,
}

/// What the bus did, and what was refused of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct WireSummary {
    /// Frames of the port.
    pub port: PortCounts,
    /// Frames and values by what became of them.
    pub decoded: Counts,
}

impl Wire {
    /// Opens the bus of the bench file.
    ///
    /// # Errors
    /// A DBC file, a role or an interface that cannot be, with its name.
    pub fn open(config: &BenchConfig, log: LogQueue) -> Result<Self, ProcessError> {
        let roles = Roles::build(&config.bus, config.period_s)?;
        let interface = &config.bus.interface;
        let port = Port::open(interface, config.bus.fd)?;
        let status = InterfaceStatus::read(interface)?;
        tracing::info!(?status.state, ?status.bit_rate, ?status.restart_ms, "interface {interface}");
        let watch = InterfaceWatch::start(interface)?;
        let mut wire = Self::on(port, roles, log);
        wire.watch = Some(watch);
        Ok(wire)
    }

    /// For the wait; -1, which `ppoll` ignores, while there is no point in waiting for it.
    #[must_use]
    pub fn descriptor(&self) -> RawFd {
        if self.is_quiet { -1 } else { self.port.as_raw_fd() }
    }
}

impl<B: Bus> Wire<B> {
    /// On a bus that is open already, with nobody to watch its interface.
    #[must_use]
    pub fn on(port: B, roles: Roles, log: LogQueue) -> Self {
        Self {
            port,
            receiver: roles.sensor_receiver(),
            sender: roles.command_sender(),
            roles,
            watch: None,
            log,
            sensors: Sensors::default(),
            refused_in_a_row: 0,
            is_quiet: false,
        }
    }

    /// Newest value of everything measured.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// Takes in what is on the bus. `was_ready` says that the wait ended because of it.
    pub fn receive(&mut self, was_ready: bool) -> Look {
        let Self { port, roles, receiver, sensors, watch, log, .. } = self;
        let gyro = SensorField::BodyRate.bit();
        let mut look = Look::default();
        let received = port.receive(|arrival| match arrival {
            Arrival::Frame { frame, stamp_ns, .. } => {
                let updated = roles.decode_sensors(receiver, &frame, stamp_ns, sensors).updated;
                look.updated |= updated != 0;
                look.gyro |= updated & gyro != 0;
            }
            Arrival::Echo { .. } => {}
            Arrival::Error { error, .. } => {
                look.bus_off |= error.is_bus_off();
                log.say(Severity::Warning, "error frame on the bus, of class", f64::from(error.class));
                if let Some(watch) = watch {
                    watch.ask();
                }
            }
        });
        match received {
            Ok(count) => self.is_quiet = was_ready && count == 0,
            Err(fault) => {
                self.log.say(Severity::Error, describe(fault), 0.0);
                self.ask();
            }
        }
        self.tell_of_interface();
        if look.updated {
            self.sensors.sequence += 1;
            self.sensors.stamp_ns = self.port.now_ns();
        }
        look
    }

    /// Has the interface looked at, where somebody watches it.
    fn ask(&self) {
        if let Some(watch) = &self.watch {
            watch.ask();
        }
    }

    /// Says what was found at the interface.
    fn tell_of_interface(&mut self) {
        while let Some(status) = self.watch.as_ref().and_then(InterfaceWatch::answer) {
            let bad = status.state.is_some_and(|state| state != socketcan::nl::CanState::ErrorActive);
            let severity = if bad || !status.is_up { Severity::Error } else { Severity::Info };
            let text = if status.is_up {
                "interface is up; its restart-ms"
            } else {
                "interface is down; its restart-ms"
            };
            self.log.say(severity, text, status.restart_ms.map_or(0.0, f64::from));
        }
    }

    /// Sends what the guard let through; the newest wins, nothing is queued or tried again.
    pub fn send(&mut self, applied: &Applied) {
        self.is_quiet = false;
        let mut fault = None;
        for frame in self.roles.encode_commands(&mut self.sender, applied).iter() {
            fault = fault.or(self.port.send(frame).err());
        }
        let Some(fault) = fault else {
            self.refused_in_a_row = 0;
            return;
        };
        self.refused_in_a_row = self.refused_in_a_row.saturating_add(1);
        if self.refused_in_a_row == 1 {
            self.log.say(Severity::Error, describe(fault), 0.0);
            self.ask();
        }
    }

    /// Whether commands no longer reach the bus: `most` in a row were refused, or none was seen there for as many
    /// periods. Counted, not timed, where it can be: a pause of this very process is no fault of the bus.
    #[must_use]
    pub fn is_dead(&self, now_ns: u64, most: u32, period_ns: u64) -> bool {
        let silent_ns = self.port.echo_age_ns(now_ns);
        self.refused_in_a_row >= most || silent_ns > period_ns.saturating_mul(u64::from(most))
    }

    /// Totals so far.
    #[must_use]
    pub fn summary(&self) -> WireSummary {
        WireSummary { port: self.port.counts(), decoded: self.receiver.counts }
    }
}

impl<B: Bus> Drop for Wire<B> {
    /// However the process ends, as long as it ends by itself: the last frames say zero.
    fn drop(&mut self) {
        self.send(&Applied::default());
    }
}

fn describe(fault: Fault) -> &'static str {
    match fault {
        Fault::Full => "the bus takes no command: no room",
        Fault::Down => "the interface is down",
        Fault::Gone => "the interface is gone",
        Fault::Other(_) => "the bus takes no command: refused by the system",
    }
}

/// Whether `interface` is virtual: no wire leaves this machine. A serial adapter (slcan) is listed among the virtual
/// interfaces, too: newer kernels give it a controller's state, older ones only the name that its user gave it.
#[must_use]
pub fn is_virtual(interface: &str) -> bool {
    let is_named_real = ["can", "slcan"].iter().any(|kind| interface.starts_with(kind));
    let is_listed = std::path::Path::new("/sys/devices/virtual/net").join(interface).exists();
    !is_named_real && is_listed && InterfaceStatus::read(interface).is_ok_and(|status| status.state.is_none())
}
