//! The bus half of a loop: frames to sensors, what the guard let through to frames, and whether the bus is alive.

use serde::Serialize;

use super::ProcessError;
use super::thresholds::THRESHOLDS;
use crate::bench::BenchConfig;
use crate::bus_guard::BusGuard;
use crate::can::{
    Arrival, BridgeEnd, Bus, BusFault, BusPort, Counts, ForeignSender, FrameRefusal, InterfaceAnswer,
    InterfaceStatus, NodeTrouble, PortCounts, check_there, is_virtual, join, protocol,
};
use crate::clock;
use crate::guard::{Cause, State};
use crate::rt::{LogQueue, Severity, Shutdown};
use crate::shm::{BUS, BenchMember, Publisher};
use crate::signal::{Applied, BusStatus, Channel, Sensors};
use std::os::fd::{AsRawFd, RawFd};

/// The bus, its protocol, and the newest value of everything measured.
#[derive(Debug)]
pub struct BusIo<B: Bus = BusPort> {
    port: B,
    end: Box<dyn BridgeEnd>,
    log: LogQueue,
    sensors: Sensors,
    /// Flags of the guard's signals as they were presented last.
    health: [u32; Channel::WATCHED.len()],
    /// Command frames in a row that the interface did not take.
    refused_in_a_row: u32,
    /// The descriptor was ready and gave nothing: not waited for until the next slot.
    is_quiet: bool,
    /// Whether the guard was disarmed when it let something through last.
    is_disarmed: bool,
    /// [ns] before which another sender's commands are not logged again.
    foreign_logged_ns: u64,
    /// Times that the interface was joined again, as far as they were logged.
    rejoined: u64,
    /// `None` where nobody can watch: on a bus in memory.
    status: Option<Publisher<BusStatus>>,
    published: u64,
    /// [ns] that the first frame without an echo had waited when the bus was listened to last.
    unheard_ns: u64,
}

/// What a look at the bus brought.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Look {
    /// [ns] CLOCK_MONOTONIC of the look: one reading of the clock serves all that follows.
    pub at_ns: u64,
    /// A sensor has a new value.
    pub updated: bool,
    /// The gyro has.
    pub gyro: bool,
    /// The controller says that it left the bus.
    pub bus_off: bool,
    /// Somebody else sends what only we may send.
    pub foreign: bool,
}

/// What the bus did, and what was refused of it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct BusIoSummary {
    /// Frames of the port.
    pub port: PortCounts,
    /// Frames and values by what became of them.
    pub decoded: Counts,
}

impl BusIo {
    /// Opens the bus of the bench file; what it does is published on `bench`. Where it has to wait for that, `shutdown` ends it.
    ///
    /// # Errors
    /// A DBC file, a role or an interface that cannot be, with its name.
    pub fn open(
        config: &BenchConfig,
        bench: &BenchMember,
        log: LogQueue,
        shutdown: &Shutdown,
    ) -> Result<Self, ProcessError> {
        let joined = join(&config.bus, &|| shutdown.is_requested())?;
        let end = protocol(&joined, config.period_s)?.bridge_end();
        let interface = &config.bus.interface;
        let port = BusPort::open_with_echo_of(interface, config.bus.fd, &end.own())?;
        if matches!(port, BusPort::Can(_)) {
            let status = InterfaceStatus::read(interface)?;
            tracing::info!(?status.state, ?status.bit_rate, ?status.restart_ms, "interface {interface}");
        }
        let mut bus_io = Self::on(port, end, log);
        bus_io.status = Some(bench.publish(&BUS)?);
        Ok(bus_io)
    }

    /// For the wait; -1, which `ppoll` ignores, while there is no point in waiting for it.
    #[must_use]
    pub fn descriptor(&self) -> RawFd {
        if self.is_quiet { -1 } else { self.port.as_raw_fd() }
    }
}

impl<B: Bus> BusIo<B> {
    /// On a bus that is open already, with nobody to watch its interface.
    #[must_use]
    pub fn on(port: B, end: impl Into<Box<dyn BridgeEnd>>, log: LogQueue) -> Self {
        Self {
            port,
            end: end.into(),
            log,
            sensors: Sensors::default(),
            health: [0; Channel::WATCHED.len()],
            refused_in_a_row: 0,
            is_quiet: false,
            is_disarmed: true,
            foreign_logged_ns: 0,
            rejoined: 0,
            status: None,
            published: 0,
            unheard_ns: 0,
        }
    }

    /// The bus, in the hands of a test.
    #[cfg(test)]
    pub(crate) fn port_mut(&mut self) -> &mut B {
        &mut self.port
    }

    /// Newest value of everything measured.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// [ns] when it looked at the bus last, a period ago at most: what needs to know no better reads no clock of its own.
    #[must_use]
    pub fn looked_ns(&self) -> u64 {
        self.port.looked_ns()
    }

    /// [ns] now, on the clock of the bus.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.port.now_ns()
    }

    /// The sensors as whoever reads them at the time of `look` must see them, [`BusGuard::marked`], and whether that is news: a
    /// value that came, or a flag that time has set though nothing came. News have a number and a stamp of their own.
    pub fn present(&mut self, look: &Look, guard: &BusGuard) -> (Sensors, bool) {
        let mut marked = guard.marked(look.at_ns, &self.sensors);
        let health = Channel::WATCHED.map(|channel| channel.of(&marked).health);
        let is_aged = self.sensors.sequence > 0 && health != self.health;
        if is_aged && !look.updated {
            self.sensors.sequence += 1;
            self.sensors.stamp_ns = look.at_ns;
            (marked.sequence, marked.stamp_ns) = (self.sensors.sequence, self.sensors.stamp_ns);
        }
        self.health = health;
        (marked, look.updated || is_aged)
    }

    /// Whether the bus must be looked at though the wait did not end because of it: it is not waited for, or its interface
    /// is gone and may be back.
    #[must_use]
    pub fn must_look(&self) -> bool {
        self.is_quiet || self.port.is_gone()
    }

    /// Takes in what is on the bus. `was_ready` says that the wait, which ended at `woken_ns`, ended because of it.
    pub fn receive(&mut self, was_ready: bool, woken_ns: u64) -> Look {
        self.port.look_at(woken_ns);
        let Self { port, end, sensors, log, .. } = self;
        let gyro = Channel::BodyRate.bit();
        let (mut look, mut has_error) = (Look::default(), false);
        let received = port.receive(|arrival| match arrival {
            Arrival::Frame { frame, stamp_ns, .. } => {
                let decoded = end.receive(&frame, stamp_ns, sensors);
                look.updated |= decoded.updated != 0;
                look.gyro |= decoded.updated & gyro != 0;
                look.foreign |= decoded.refused == Some(FrameRefusal::ForeignCommand);
            }
            Arrival::Echo { .. } => {}
            Arrival::Error { error, .. } => {
                look.bus_off |= error.is_bus_off();
                log.say(Severity::Warning, "error frame on the bus, of class", f64::from(error.class));
                has_error = true;
            }
        });
        match received {
            Ok(count) => self.is_quiet = was_ready && count == 0,
            Err(fault) => {
                self.log.say(Severity::Error, describe(fault), 0.0);
                has_error = true;
            }
        }
        if has_error {
            self.port.ask();
        }
        look.at_ns = self.port.looked_ns();
        if look.updated {
            self.sensors.sequence += 1;
            self.sensors.stamp_ns = look.at_ns;
        }
        if look.foreign {
            self.log_foreign_sender();
        }
        look
    }

    fn log_foreign_sender(&mut self) {
        let now_ns = self.port.now_ns();
        if now_ns >= self.foreign_logged_ns {
            self.foreign_logged_ns = now_ns.saturating_add(THRESHOLDS.foreign_logged_every_ns);
            let text = "another sender commands the rotors; its frames so far";
            self.log.say(Severity::Error, text, self.end.counts().foreign_command as f64);
            for (text, value) in self.end.foreign().map(ForeignSender::said).into_iter().flatten() {
                self.log.say(Severity::Error, text, value);
            }
        }
    }

    /// Says what was found at the interface.
    fn log_interface(&mut self) {
        let rejoined = self.port.counts().rejoined;
        if rejoined != self.rejoined {
            self.rejoined = rejoined;
            self.log.say(
                Severity::Warning,
                "the interface was gone and is joined again; times",
                rejoined as f64,
            );
            self.port.ask();
        }
        while let Some(InterfaceAnswer { status, is_as_opened }) = self.port.answer() {
            if status.is_up && !is_as_opened {
                let text =
                    "the interface is up with other bit rates than at the start, or without FD; its bit/s";
                self.log.say(Severity::Error, text, status.bit_rate.map_or(0.0, f64::from));
                continue;
            }
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

    /// Sends what the guard let through; the newest wins, nothing is queued or tried again. [ns] when it was out.
    pub fn send(&mut self, applied: &Applied) -> u64 {
        self.is_quiet = false;
        self.is_disarmed = applied.state == State::Disarmed as u32;
        let (out_ns, fault) = self.port.send_all(self.end.commands(applied));
        let due = self.end.due_frames(out_ns, applied);
        if !due.is_empty() {
            // Whether there is room for the commands decides; what is due stays due.
            let _ = self.port.send_all(due);
        }
        let Some(fault) = fault else {
            self.refused_in_a_row = 0;
            return out_ns;
        };
        self.refused_in_a_row = self.refused_in_a_row.saturating_add(1);
        if self.refused_in_a_row == 1 {
            self.log.say(Severity::Error, describe(fault), 0.0);
            self.port.ask();
        }
        out_ns
    }

    /// Publishes what the bus does, says what was found at its interface, and listens for the echoes now and then: once a
    /// period, after the commands are out.
    pub fn publish(&mut self, now_ns: u64) {
        self.log_interface();
        if self.status.is_none() {
            return;
        }
        let now = self.count(now_ns);
        if let Some(status) = &mut self.status {
            status.send(&now);
        }
    }

    /// What is published this period. Of the echoes it says what was heard, and not what nobody has listened for yet.
    pub(crate) fn count(&mut self, now_ns: u64) -> BusStatus {
        self.published += 1;
        // Where the answer could be the one that says no, it is asked for at once: `is_dead`.
        if self.published.is_multiple_of(THRESHOLDS.listen_every) {
            self.listen(now_ns);
        }
        let (port, decoded) = (self.port.counts(), self.end.counts());
        BusStatus {
            sequence: self.published,
            stamp_ns: now_ns,
            echo_age_ns: self.unheard_ns,
            received: port.received,
            lost: port.dropped,
            sent: port.sent,
            echoed: port.echoed,
            not_sent: port.full + port.down + port.failed,
            error_frames: port.errors,
            unknown_id: decoded.unknown_id,
            foreign_command: decoded.foreign_command,
            wrong_length: decoded.wrong_length,
            counter: decoded.counter,
            not_a_number: decoded.not_a_number,
            out_of_range: decoded.out_of_range,
        }
    }

    fn listen(&mut self, now_ns: u64) {
        self.port.listen();
        self.unheard_ns = self.port.echo_age_ns(now_ns);
    }

    /// Why the guard must latch, if the bus gives a reason: see [`BusIo::is_dead`]; and two who command one rotor are one
    /// too many.
    #[must_use]
    pub fn trouble(&mut self, look: &Look, now_ns: u64, most: u32, period_ns: u64) -> Option<Cause> {
        if look.bus_off || self.is_dead(now_ns, most, period_ns) {
            Some(Cause::BusDead)
        } else if look.foreign {
            Some(Cause::ForeignCommand)
        } else if self.is_disarmed {
            // Nodes may be switched off and on while nobody needs them.
            None
        } else {
            self.end.trouble(now_ns).map(|trouble| match trouble {
                NodeTrouble::Silent { .. } => Cause::NodeSilent,
                NodeTrouble::Unhealthy { .. } => Cause::NodeUnhealthy,
                NodeTrouble::Twice { .. } => Cause::NodeIdTwice,
            })
        }
    }

    /// Whether commands no longer reach the bus: `most` in a row were refused, or none was seen there for as many
    /// periods. Counted, not timed, where it can be: a pause of this very process is no fault of the bus.
    #[must_use]
    pub fn is_dead(&mut self, now_ns: u64, most: u32, period_ns: u64) -> bool {
        let longest_ns = period_ns.saturating_mul(u64::from(most));
        if self.port.echo_age_ns(now_ns) > longest_ns {
            // Or nobody has listened.
            self.listen(now_ns);
        }
        self.refused_in_a_row >= most || self.port.echo_age_ns(now_ns) > longest_ns
    }

    /// Totals so far.
    #[must_use]
    pub fn summary(&mut self) -> BusIoSummary {
        self.port.listen();
        BusIoSummary { port: self.port.counts(), decoded: self.end.counts() }
    }
}

impl<B: Bus> Drop for BusIo<B> {
    /// However the process ends, as long as it ends by itself: the last frames say zero.
    fn drop(&mut self) {
        self.send(&Applied::default());
    }
}

fn describe(fault: BusFault) -> &'static str {
    match fault {
        BusFault::Full => "the bus takes no command: no room",
        BusFault::Down => "the interface is down",
        BusFault::Gone => "the interface is gone",
        BusFault::Other(_) => "the bus takes no command: refused by the system",
    }
}

/// Refuses to arm by itself what may be real hardware.
pub(crate) fn check_arming(config: &BenchConfig, arm: bool) -> Result<(), ProcessError> {
    let interface = &config.bus.interface;
    if !arm || is_virtual(interface) {
        return Ok(());
    }
    // What is not there is not hardware either, and to say so would send its user round in a circle.
    check_there(interface)?;
    Err(ProcessError::ArmOnHardware { interface: interface.clone() })
}

/// Ends a loop that owns a guard: `turn` until the ramp has brought the rotors to zero, or the time for it is up.
pub(crate) fn ramp_down<L>(owner: &mut L, guard: fn(&mut L) -> &mut BusGuard, turn: fn(&mut L)) {
    let now_ns = clock::monotonic_ns();
    guard(owner).trip(now_ns, Cause::Shutdown);
    let latest_ns = now_ns.saturating_add(clock::span_ns(THRESHOLDS.longest_end_s));
    turn(owner);
    while !guard(owner).is_safe() && clock::monotonic_ns() < latest_ns {
        turn(owner);
    }
}
