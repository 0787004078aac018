//! The emulator on a CAN bus: it plays both ESCs, the IMU and the bench's other sensors, so that a bridge sees no
//! difference from the bench. No guard here: that is the bridge's. An ESC has only its own timeout.

use std::os::fd::AsRawFd;

use crate::can::{
    Arrival, Counts, Fault, Port, PortCounts, ReceiverState, Roles, RotorCommands, SenderState,
};
use crate::clock;
use crate::rt::{self, LogQueue, Severity, Shutdown};
use crate::signal::ROTORS;

use super::behind_guard::{BodySummary, EmulationOptions, end_ns};
use super::{Emulator, EmulatorState};

/// The emulated bench's side of the bus.
#[derive(Debug)]
pub struct EmulatedBus {
    roles: Roles,
    port: Port,
    receiver: ReceiverState,
    sender: SenderState,
    commands: RotorCommands,
    /// [ns] period of each sensor message, and when it is due next.
    schedule: Vec<(u64, u64)>,
    is_up: bool,
}

/// What the bus saw.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct BusSummary {
    /// Body and battery.
    pub body: BodySummary,
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
    pub fn new(roles: Roles, port: Port) -> Self {
        let now_ns = clock::monotonic_ns();
        // A period too short to keep would starve the receiver; roles with one were refused by their bus load.
        let period = |period_s| clock::span_ns(period_s).max(50_000);
        let schedule =
            roles.sensor_messages().iter().map(|message| (period(message.period_s), now_ns)).collect();
        Self {
            receiver: roles.command_receiver(),
            sender: roles.sensor_sender(),
            roles,
            port,
            commands: RotorCommands::default(),
            schedule,
            is_up: true,
        }
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
        let mut body = BodySummary::default();
        loop {
            let now_ns = clock::monotonic_ns();
            if shutdown.is_requested() || now_ns >= end_ns {
                return self.summary(body);
            }
            emulator.advance(&mut state, now_ns - start_ns);
            self.receive(emulator, &mut state, log);
            let is_flown = self.commands.rotor.iter().any(|command| *command > 0.0);
            if self.send_due(now_ns, &state) {
                body.add(&emulator.truth(&state), is_flown, clock::span_s(now_ns - start_ns));
            }
            let due_ns = self.schedule.iter().map(|(_, due)| *due).min().unwrap_or(u64::MAX);
            let _ = rt::wait([self.port.as_raw_fd()], due_ns.min(now_ns + LONGEST_WAIT_NS));
        }
    }

    fn receive(&mut self, emulator: &Emulator, state: &mut EmulatorState, log: &LogQueue) {
        let Self { roles, port, receiver, commands, is_up, .. } = self;
        let received = port.receive(|arrival| {
            let Arrival::Frame { frame, stamp_ns, .. } = arrival else { return };
            *is_up = true;
            let decoded = roles.decode_commands(receiver, &frame, stamp_ns, commands);
            for rotor in (0..ROTORS).filter(|rotor| decoded.updated & (1 << rotor) != 0) {
                emulator.command_rotor(state, rotor, commands.rotor[rotor]);
            }
        });
        if received.is_err() && std::mem::replace(is_up, false) {
            log.say(Severity::Warning, "the bus is down; the emulated ESCs stop by their own timeout", 0.0);
        }
    }

    /// Sends every sensor message that is due; whether one was.
    fn send_due(&mut self, now_ns: u64, state: &EmulatorState) -> bool {
        let mut any = false;
        for (index, (period, due)) in self.schedule.iter_mut().enumerate() {
            if *due > now_ns {
                continue;
            }
            // Messages missed while the machine slept are not sent in a burst.
            *due = due.saturating_add(period.saturating_mul((now_ns - *due) / *period + 1));
            let fields = self.roles.sensor_messages().get(index).map(|message| message.bindings());
            let has_values = |bindings: &[crate::can::Binding<crate::signal::Channel>]| {
                bindings.iter().any(|binding| binding.field.of(state.sensors()).stamp_ns > 0)
            };
            if !fields.is_some_and(has_values) {
                continue;
            }
            if let Some(frame) = self.roles.encode_sensors(&mut self.sender, index, state.sensors()) {
                // Dropped and counted by the port; the next one is newer.
                let _: Result<(), Fault> = self.port.send(&frame);
                any = true;
            }
        }
        any
    }

    fn summary(&self, body: BodySummary) -> BusSummary {
        let PortCounts { sent, full, down, failed, .. } = self.port.counts();
        BusSummary { body, commands: self.receiver.counts, sent, not_sent: full + down + failed }
    }
}

/// [ns] after which the emulated bus looks for its end, though nothing happens.
const LONGEST_WAIT_NS: u64 = 100_000_000;
