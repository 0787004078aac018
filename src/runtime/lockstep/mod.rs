//! The bench on virtual time: emulator, guard and command source step by step in one thread, bit-identical from run to
//! run and as fast as the machine can. Timeouts are counted in virtual time, so that failsafe paths repeat too.
//!
//! A program that runs a controller of its own: `examples/own_controller.rs`.

pub mod digest;
mod own_controller;
pub mod run;
pub mod two_process;
use crate::clock;
use crate::emulate::{Emulator, EmulatorState, Truth};
use crate::experiment::Experiment;
use crate::guard::{Guard, GuardState, OperatorAct};
use crate::signal::{Applied, Command, ControlStep, GuardEvent, GuardStep, ROTORS, Request, Sensors};

use super::command_source::{CommandSource, CommandSourceState};
use super::trace::LogTrace;

pub use own_controller::run_controller;

/// [ns] at which virtual time begins; zero would mean "never".
pub const ORIGIN_NS: u64 = clock::NANOSECONDS_PER_SECOND;

/// Emulator and guard: the bench without its command source.
#[derive(Debug, Clone)]
pub struct EmulatedBench {
    emulator: Emulator,
    guard: Option<Guard>,
    period_ns: u64,
}

/// The bench between two slots.
#[derive(Debug, Clone)]
pub struct EmulatedBenchState {
    emulator: EmulatorState,
    guard: GuardState,
    applied: Applied,
    newest: Option<Command>,
    slot: u64,
}

/// What a command source is given in a slot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlotInputs {
    /// Number of the slot, from 0.
    pub slot: u64,
    /// [ns] virtual time.
    pub now_ns: u64,
    /// What was measured.
    pub sensors: Sensors,
    /// What the guard let through last.
    pub applied: Applied,
}

/// The bench as built.
#[derive(Debug, Clone)]
pub struct Lockstep {
    bench: EmulatedBench,
    source: CommandSource,
}

/// The bench between two slots.
#[derive(Debug, Clone)]
pub struct LockstepState {
    bench: EmulatedBenchState,
    source: CommandSourceState,
}

/// What happened in one slot.
///
/// Printed by `examples/own_controller.rs`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slot {
    /// Number, from 0.
    pub slot: u64,
    /// [s] when it began.
    pub time: f64,
    /// What the controller saw.
    pub sensors: Sensors,
    /// What the controller said; `None` when it was silent.
    pub command: Option<Command>,
    /// What the rotors got, from this slot's beginning to its end.
    pub applied: Applied,
    /// What really was, at the slot's beginning.
    pub truth: Truth,
}

/// Interferes with a run: injects faults, and acts as the operator. `()` does nothing.
pub trait Interference {
    /// Changes what is measured on its way to controller and guard.
    fn sensors(&mut self, _slot: u64, _sensors: &mut Sensors) {}

    /// Changes what is commanded on its way to the guard; `None` loses it.
    fn command(&mut self, _slot: u64, command: Command) -> Option<Command> {
        Some(command)
    }

    /// The operator's act in this slot; by default he arms in the first one, as `--arm` does.
    fn act(&mut self, slot: u64) -> Option<OperatorAct> {
        (slot == 0).then_some(OperatorAct::Arm)
    }

    /// Looks on at what the guard decided and refused.
    fn event(&mut self, _event: &GuardEvent) {}

    /// Looks on at a step of the controller, with all it consumed.
    fn control_step(&mut self, _step: &ControlStep) {}

    /// Looks on at a period of the guard, with all it consumed.
    fn guard_step(&mut self, _step: &GuardStep) {}
}

impl Interference for () {}

impl EmulatedBench {
    /// A bench of `emulator` behind `guard`, stepped every `period_s`. Without a guard: for the study of a controller
    /// alone.
    #[must_use]
    pub fn new(emulator: Emulator, guard: Option<Guard>, period_s: f64) -> Self {
        Self { emulator, guard, period_ns: clock::span_ns(period_s).max(1) }
    }

    /// At rest.
    #[must_use]
    pub fn start(&self) -> EmulatedBenchState {
        EmulatedBenchState {
            emulator: self.emulator.start(ORIGIN_NS),
            guard: GuardState::new(),
            applied: Applied::default(),
            newest: None,
            slot: 0,
        }
    }

    /// Number of slots that `seconds` have.
    #[must_use]
    pub fn slots(&self, seconds: f64) -> u64 {
        clock::span_ns(seconds).div_ceil(self.period_ns)
    }

    /// The first half of a slot: measures.
    pub fn ask(&self, state: &EmulatedBenchState, interference: &mut impl Interference) -> SlotInputs {
        let mut sensors = *state.emulator.sensors();
        interference.sensors(state.slot, &mut sensors);
        let now_ns = ORIGIN_NS + state.emulator.now_ns();
        SlotInputs { slot: state.slot, now_ns, sensors, applied: state.applied }
    }

    /// The second half: lets `command` through, as far as the guard does, and turns the rotors. `None`: nobody answered.
    pub fn take(
        &self,
        state: &mut EmulatedBenchState,
        inputs: &SlotInputs,
        command: Option<Command>,
        interference: &mut impl Interference,
    ) -> Slot {
        state.newest = command.or(state.newest);
        let truth = self.emulator.truth(&state.emulator);
        state.applied = self.let_through(state, inputs, interference);
        self.emulator.command(&mut state.emulator, state.applied.rotor);
        state.slot += 1;
        self.emulator.advance(&mut state.emulator, state.slot.saturating_mul(self.period_ns));
        let time = clock::span_s(inputs.slot.saturating_mul(self.period_ns));
        let SlotInputs { slot, sensors, .. } = *inputs;
        Slot { slot, time, sensors, command, applied: state.applied, truth }
    }

    fn let_through(
        &self,
        state: &mut EmulatedBenchState,
        inputs: &SlotInputs,
        interference: &mut impl Interference,
    ) -> Applied {
        let SlotInputs { slot, now_ns, sensors, .. } = inputs;
        let newest = state.newest.as_ref();
        let Some(guard) = &self.guard else {
            return pass_through(state.applied.sequence + 1, *now_ns, newest);
        };
        let request = interference.act(*slot).map(|act| Request {
            sequence: slot + 1,
            stamp_ns: *now_ns,
            act: act as u32,
            ..Request::default()
        });
        let applied = guard.step(&mut state.guard, *now_ns, sensors, newest, request.as_ref());
        interference.guard_step(&GuardStep::new(*now_ns, sensors, newest, request.as_ref(), &applied));
        state.guard.take_events().for_each(|event| interference.event(&event));
        applied
    }
}

impl Lockstep {
    /// A bench of `emulator` and `command source`, stepped every `period_s`. No guard: for the study of a controller alone.
    #[must_use]
    pub fn new(emulator: Emulator, source: CommandSource, period_s: f64) -> Self {
        Self { bench: EmulatedBench::new(emulator, None, period_s), source }
    }

    /// The same bench with `guard` in front of its rotors, as every running bench has it.
    #[must_use]
    pub fn guarded(self, guard: Guard) -> Self {
        Self { bench: EmulatedBench { guard: Some(guard), ..self.bench }, ..self }
    }

    /// The bench at rest.
    #[must_use]
    pub fn start(&self) -> LockstepState {
        LockstepState { bench: self.bench.start(), source: self.source.start() }
    }

    /// One slot: measure, decide, let through, turn.
    pub fn step(&self, state: &mut LockstepState, interference: &mut impl Interference) -> Slot {
        let inputs = self.bench.ask(&state.bench, interference);
        let SlotInputs { slot, now_ns, sensors, applied } = inputs;
        let mut command = self.source.step(&mut state.source, &sensors, &applied);
        command.stamp_ns = now_ns;
        interference.control_step(&ControlStep { sensors, applied, command });
        let command = interference.command(slot, command);
        self.bench.take(&mut state.bench, &inputs, command, interference)
    }

    /// Number of slots that `seconds` have.
    #[must_use]
    pub fn slots(&self, seconds: f64) -> u64 {
        self.bench.slots(seconds)
    }

    /// Slot of the experiment that the last step commanded, lead-in included; `None` when it commanded none.
    #[must_use]
    pub fn experiment_slot(&self, state: &LockstepState) -> Option<u64> {
        self.source.experiment_slot(&state.source)
    }

    /// Whether the experiment has run to its end.
    #[must_use]
    pub fn is_finished(&self, state: &LockstepState) -> bool {
        self.source.finished(&state.source)
    }

    /// Runs from rest for `seconds` and keeps every slot.
    #[must_use]
    pub fn run(&self, seconds: f64, interference: &mut impl Interference) -> Vec<Slot> {
        let mut state = self.start();
        (0..self.slots(seconds)).map(|_| self.step(&mut state, interference)).collect()
    }
}

/// Lets everything within 0..1 through: for the study of a controller alone.
fn pass_through(sequence: u64, now_ns: u64, newest: Option<&Command>) -> Applied {
    let pass = |u: f64| if u.is_finite() { u.clamp(0.0, 1.0) } else { 0.0 };
    Applied {
        sequence,
        stamp_ns: now_ns,
        command_sequence: newest.map_or(0, |command| command.sequence),
        rotor: newest.map_or([0.0; ROTORS], |command| command.rotor.map(pass)),
        ..Applied::default()
    }
}

/// Drives the emulated rotors with an experiment, open loop and without a guard, and gives the log from the
/// first excited slot on. For what a guard may say to it, see [`Experiment::check`].
#[must_use]
pub fn drive(emulator: &Emulator, experiment: &Experiment) -> LogTrace {
    let mut state = emulator.start(ORIGIN_NS);
    let mut trace = LogTrace::default();
    let period_ns = clock::span_ns(experiment.period_s()).max(1);
    for slot in 0..experiment.slots() {
        let applied = Applied { rotor: experiment.command(slot), ..Applied::default() };
        if let Some(logged) = slot.checked_sub(experiment.lead_in()) {
            trace.push(logged.saturating_mul(period_ns), state.sensors(), &applied);
        }
        emulator.command(&mut state, applied.rotor);
        emulator.advance(&mut state, (slot + 1).saturating_mul(period_ns));
    }
    trace
}
