//! The emulator on a CAN bus: it plays both ESCs, the IMU and the bench's other sensors, so that a bridge sees no
//! difference from the bench. No guard here: that is the bridge's. An ESC has only its own timeout.

use std::os::fd::AsRawFd;

use crate::can::{Arrival, BenchEnd, Bus, BusFault, BusPort, Counts, PortCounts, RotorCommands};
use crate::clock;
use crate::rt::{self, LogQueue, Severity, Shutdown};
use crate::signal::ROTORS;

use super::behind_guard::{BodyMotion, EmulationOptions, end_ns};
use super::{Emulator, EmulatorState};

/// The emulated bench's side of the bus.
#[derive(Debug)]
pub struct EmulatedBus {
    end: Box<dyn BenchEnd>,
    port: BusPort,
    commands: RotorCommands,
    is_up: bool,
    /// Nodes that ask for their ids, as it was logged last.
    without_id: usize,
}

/// What the bus saw.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct BusSummary {
    /// Body and battery.
    pub body: BodyMotion,
    /// Command frames, by what became of them.
    pub commands: Counts,
    /// Frames sent.
    pub sent: u64,
    /// Frames that found no room on the bus, or no bus.
    pub not_sent: u64,
}

impl EmulatedBus {
    /// Joins the bus.
    #[must_use]
    pub fn new(end: Box<dyn BenchEnd>, port: BusPort) -> Self {
        Self { end, port, commands: RotorCommands::default(), is_up: true, without_id: 0 }
    }

    /// Runs the emulated bench in real time, until `shutdown`.
    pub fn run(
        &mut self,
        emulator: &Emulator,
        options: EmulationOptions,
        shutdown: &Shutdown,
        log: &LogQueue,
    ) -> BusSummary {
        let start_ns = clock::monotonic_ns();
        let end_ns = end_ns(start_ns, options.duration_s);
        let mut state = emulator.start(start_ns);
        let mut body = BodyMotion::default();
        loop {
            let now_ns = clock::monotonic_ns();
            if shutdown.is_requested() || now_ns >= end_ns {
                return self.summary(body);
            }
            emulator.advance(&mut state, now_ns - start_ns);
            self.receive(emulator, &mut state, log);
            self.log_ids(log);
            let is_turning = self.commands.rotor.iter().any(|command| *command > 0.0);
            if self.send_due(now_ns, &state) {
                body.add(&emulator.truth(&state), is_turning, clock::span_s(now_ns - start_ns));
            }
            let _ = rt::wait([self.port.as_raw_fd()], self.end.due_ns().min(now_ns + LONGEST_WAIT_NS));
        }
    }

    fn receive(&mut self, emulator: &Emulator, state: &mut EmulatorState, log: &LogQueue) {
        let Self { end, port, commands, is_up, .. } = self;
        let received = port.receive(|arrival| {
            let Arrival::Frame { frame, stamp_ns, .. } = arrival else { return };
            *is_up = true;
            let decoded = end.receive(&frame, stamp_ns, commands);
            let may_turn = end.may_turn(stamp_ns);
            for rotor in (0..ROTORS).filter(|rotor| decoded.updated & (1 << rotor) != 0) {
                emulator.command_rotor(state, rotor, if may_turn { commands.rotor[rotor] } else { 0.0 });
            }
        });
        if received.is_err() && std::mem::replace(is_up, false) {
            log.say(Severity::Warning, "the bus is down; the emulated ESCs stop by their own timeout", 0.0);
        }
    }

    fn log_ids(&mut self, log: &LogQueue) {
        let without_id = self.end.without_id();
        if without_id != self.without_id {
            self.without_id = without_id;
            log.say(Severity::Info, "emulated nodes that ask for a node id", without_id as f64);
        }
    }

    /// Sends everything that is due; whether a sensor's message was.
    fn send_due(&mut self, now_ns: u64, state: &EmulatorState) -> bool {
        let Self { end, port, .. } = self;
        end.send_due(now_ns, state.sensors(), &mut |frame| {
            // Dropped and counted by the port; the next one is newer.
            let _: Result<(), BusFault> = port.send(frame);
        })
    }

    fn summary(&self, body: BodyMotion) -> BusSummary {
        let PortCounts { sent, full, down, failed, .. } = self.port.counts();
        BusSummary { body, commands: self.end.counts(), sent, not_sent: full + down + failed }
    }
}

/// [ns] after which the emulated bus looks for its end, though nothing happens.
const LONGEST_WAIT_NS: u64 = 100_000_000;
