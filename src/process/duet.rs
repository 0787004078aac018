//! Lockstep between two processes: the emulator numbers each step, the controller answers it by number, and neither
//! goes on before the other. Time is virtual on both sides, so the run is the same to the last bit as
//! [`super::lockstep`] in one thread.
//!
//! A peer that does not answer for the patience (of the machine's clock) is taken as gone: virtual time then runs on
//! without commands, and the guard's own timeouts, in virtual time, drive the failsafe. Nothing hangs.

use super::ProcessError;
use super::flight::{AngleError, Flight};
use super::lockstep::ORIGIN_NS;
use super::pilot::Pilot;
use crate::bench::BenchConfig;
use crate::clock;
use crate::emulate::{EmulatorState, Truth};
use crate::guard::{GuardState, OperatorAct, State};
use crate::rt::{self, Shutdown};
use crate::shm::{
    APPLIED, Bell, Bench, COMMAND, GUARD_EVENTS, GUARD_STEPS, Publisher, Role, SENSORS, Subscriber, Waiter,
};
use crate::signal::{Applied, Command, GuardEvent, GuardStep, Request, Sensors};

/// How the emulator's side ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DuetSummary {
    /// Slots run.
    pub slots: u64,
    /// Slots that were answered.
    pub answered: u64,
    /// What really was at the end.
    pub truth: Truth,
    /// What the rotors got last.
    pub applied: Applied,
}

/// The emulator's side: topics and the peer's state.
struct Conductor {
    sensors: Publisher<Sensors>,
    applied: Publisher<Applied>,
    steps: Publisher<GuardStep>,
    events: Publisher<GuardEvent>,
    commands: Subscriber<Command>,
    control_bell: Bell,
    bell: Bell,
    patience_ns: u64,
    is_peer_gone: bool,
    has_peer_come: bool,
    // Last: everything above lives on it.
    _bench: Bench,
}

impl Conductor {
    fn open(config: &BenchConfig, patience_s: f64) -> Result<Self, ProcessError> {
        let bench = Bench::join(&config.name, &config.shared_memory, Role::Emulate)?;
        Ok(Self {
            sensors: bench.publish(&SENSORS)?,
            applied: bench.publish(&APPLIED)?,
            steps: bench.publish(&GUARD_STEPS)?,
            events: bench.publish(&GUARD_EVENTS)?,
            commands: bench.subscribe(&COMMAND)?,
            control_bell: bench.bell(Waiter::Control)?,
            bell: bench.bell(Waiter::Gate)?,
            patience_ns: clock::span_ns(patience_s),
            is_peer_gone: false,
            has_peer_come: false,
            _bench: bench,
        })
    }

    /// Sends a step and waits for its answer. Before the first answer of all it waits as long as it takes: a bench
    /// without a controller has not begun.
    fn ask(&mut self, sensors: &Sensors, shutdown: &Shutdown) -> Option<Command> {
        /// [ns] between two looks at `shutdown`, and between two tries to reach a peer that is late to join.
        const LOOK_NS: u64 = 20_000_000;
        let asked_ns = clock::monotonic_ns();
        loop {
            self.sensors.send(sensors);
            self.control_bell.ring();
            let look_ns = clock::monotonic_ns().saturating_add(if self.is_peer_gone { 0 } else { LOOK_NS });
            loop {
                let newest = self.commands.newest();
                if let Some(command) = newest.filter(|it| it.sensors_sequence == sensors.sequence) {
                    (self.has_peer_come, self.is_peer_gone) = (true, false);
                    return Some(command);
                }
                if clock::monotonic_ns() >= look_ns {
                    break;
                }
                let _ = rt::wait([self.bell.descriptor()], look_ns);
                self.bell.quiet();
            }
            let waited_ns = clock::monotonic_ns().saturating_sub(asked_ns);
            let is_patient = !self.is_peer_gone && (!self.has_peer_come || waited_ns < self.patience_ns);
            if shutdown.is_requested() || !is_patient {
                self.is_peer_gone = self.has_peer_come;
                return None;
            }
        }
    }
}

/// Runs the emulated bench and its guard for `seconds` of virtual time, asking the controller at each slot.
///
/// # Errors
/// A second emulator or bridge on the same bench; settings that cannot be.
pub fn conduct(
    config: &BenchConfig,
    seconds: f64,
    patience_s: f64,
    shutdown: &Shutdown,
) -> Result<DuetSummary, ProcessError> {
    config.check()?;
    let emulator = super::emulate::emulator(config)?;
    let guard = config.guard.build(config.period_s)?;
    let mut conductor = Conductor::open(config, patience_s)?;
    let period_ns = clock::span_ns(config.period_s);
    let slots = clock::span_ns(seconds).div_ceil(period_ns);
    let mut state: EmulatorState = emulator.start(ORIGIN_NS);
    let (mut guard_state, mut applied, mut newest) = (GuardState::new(), Applied::default(), None);
    let (mut slot, mut answered) = (0, 0);
    while slot < slots && !shutdown.is_requested() {
        let sensors = *state.sensors();
        let now_ns = ORIGIN_NS + state.now_ns();
        if let Some(command) = conductor.ask(&sensors, shutdown) {
            answered += 1;
            newest = Some(command);
        }
        let request = (slot == 0).then_some(Request {
            sequence: 1,
            stamp_ns: now_ns,
            act: OperatorAct::Arm as u32,
            reserved: 0,
        });
        applied = guard.step(&mut guard_state, now_ns, &sensors, newest.as_ref(), request.as_ref());
        conductor.applied.send(&applied);
        let step = GuardStep::new(now_ns, &sensors, newest.as_ref(), request.as_ref(), &applied);
        conductor.steps.send(&step);
        guard_state.take_events().for_each(|event| conductor.events.send(&event));
        emulator.command(&mut state, applied.rotor);
        slot += 1;
        emulator.advance(&mut state, slot.saturating_mul(period_ns));
        let is_latched = applied.state == State::FailsafeLatched as u32;
        if conductor.is_peer_gone && is_latched && applied.rotor == [0.0; 2] {
            tracing::warn!(slot, "the controller is gone; the failsafe has stopped the rotors");
            break;
        }
    }
    Ok(DuetSummary { slots: slot, answered, truth: emulator.truth(&state), applied })
}

/// The controller's side: answers each step until none has come for `patience_s`, or until `shutdown`.
///
/// # Errors
/// A second controller on the same bench.
pub fn answer(
    config: &BenchConfig,
    pilot: Pilot,
    patience_s: f64,
    shutdown: &Shutdown,
) -> Result<AngleError, ProcessError> {
    config.check()?;
    let bench = Bench::join(&config.name, &config.shared_memory, Role::Control)?;
    let mut flight = Flight::open(&bench, pilot)?;
    let mut sensors = bench.subscribe(&SENSORS)?;
    let mut applied = bench.subscribe(&APPLIED)?;
    let (gate_bell, bell) = (bench.bell(Waiter::Gate)?, bench.bell(Waiter::Control)?);
    let mut passed = Applied::default();
    let mut last: Option<Command> = None;
    let mut heard_ns = clock::monotonic_ns();
    while !shutdown.is_requested() {
        let now_ns = clock::monotonic_ns();
        if last.is_some() && now_ns.saturating_sub(heard_ns) > clock::span_ns(patience_s) {
            break;
        }
        let _ = rt::wait([bell.descriptor()], now_ns.saturating_add(20_000_000));
        bell.quiet();
        while let Some(sensors) = sensors.next_in_order() {
            heard_ns = clock::monotonic_ns();
            passed = applied.newest().unwrap_or(passed);
            // A step that is asked again is answered again, not flown again.
            let again = last.filter(|command| command.sensors_sequence == sensors.sequence);
            let command = again.unwrap_or_else(|| flight.step(sensors.stamp_ns, &sensors, &passed));
            flight.publish(&sensors, &passed, &command);
            last = Some(command);
            gate_bell.ring();
        }
    }
    Ok(flight.angle())
}
