//! Lockstep between two processes: the emulator numbers each step, the controller answers it by number, and neither
//! goes on before the other. Time is virtual on both sides, so the run is the same to the last bit as
//! [`crate::runtime::lockstep`] in one thread.
//!
//! A peer that does not answer for the patience (of the machine's clock) is taken as gone: virtual time then runs on
//! without commands, and the guard's own timeouts, in virtual time, drive the failsafe. Nothing hangs.

use super::run::{LockstepSummary, RunLog};
use super::{EmulatedBench, Interference, Slot, SlotInputs};
use crate::bench::BenchConfig;
use crate::clock;
use crate::guard::State;
use crate::recording::RecordSender;
use crate::rt::{self, Shutdown};
use crate::runtime::ProcessError;
use crate::runtime::command_source::CommandSource;
use crate::runtime::control_output::{AngleError, ControlOutput};
use crate::shm::{
    APPLIED, Bell, BenchMember, GUARD_EVENTS, GUARD_STEPS, LOCKSTEP_ANSWERS, LOCKSTEP_STEPS, ProcessRole,
    Publisher, SENSORS, Subscriber, Waiter,
};
use crate::signal::{
    Applied, Command, ControlStep, GuardEvent, GuardStep, LockstepAnswer, LockstepStep, ROTORS, Sensors,
};

/// [ns] between two looks at the shutdown, and between two tries to reach a peer that is late to join.
const LOOK_NS: u64 = 20_000_000;

/// The line to the controller, and whether it is there.
struct Line {
    run: u64,
    steps: Publisher<LockstepStep>,
    answers: Subscriber<LockstepAnswer>,
    control_bell: Bell,
    bell: Bell,
    patience_ns: u64,
    has_come: bool,
    is_gone: bool,
}

impl Line {
    fn open(bench: &BenchMember, patience_s: f64) -> Result<Self, ProcessError> {
        Ok(Self {
            run: clock::monotonic_ns(),
            steps: bench.publish(&LOCKSTEP_STEPS)?,
            answers: bench.subscribe(&LOCKSTEP_ANSWERS)?,
            control_bell: bench.bell(Waiter::Control)?,
            bell: bench.bell(Waiter::Guard)?,
            patience_ns: clock::span_ns(patience_s),
            has_come: false,
            is_gone: false,
        })
    }

    /// Sends a step and waits for its answer. Before the first answer of all it waits as long as it takes: a bench
    /// without a controller has not begun. Who was silent for the patience once is not waited for again.
    fn ask(&mut self, inputs: &SlotInputs, shutdown: &Shutdown) -> Option<Command> {
        if self.is_gone {
            return None;
        }
        let SlotInputs { slot, now_ns, sensors, applied } = *inputs;
        let step = LockstepStep { run: self.run, number: slot + 1, now_ns, sensors, applied };
        let asked_ns = clock::monotonic_ns();
        while !shutdown.is_requested() {
            self.steps.send(&step);
            self.control_bell.ring();
            if let Some(command) = self.answer_until(&step, clock::monotonic_ns().saturating_add(LOOK_NS)) {
                self.has_come = true;
                return Some(command);
            }
            let waited_ns = clock::monotonic_ns().saturating_sub(asked_ns);
            if self.has_come && waited_ns >= self.patience_ns {
                tracing::warn!(slot, "the controller does not answer; virtual time runs on without it");
                self.is_gone = true;
                return None;
            }
        }
        None
    }

    /// Says that the run is over.
    fn end(&mut self) {
        self.steps.send(&LockstepStep { run: self.run, ..LockstepStep::default() });
        self.control_bell.ring();
    }

    fn answer_until(&mut self, step: &LockstepStep, until_ns: u64) -> Option<Command> {
        loop {
            while let Some(answer) = self.answers.next_in_order() {
                if (answer.run, answer.number) == (step.run, step.number) {
                    return Some(answer.command);
                }
            }
            if clock::monotonic_ns() >= until_ns {
                return None;
            }
            let _ = rt::wait([self.bell.descriptor()], until_ns);
            self.bell.quiet();
        }
    }
}

/// What recorder and monitor see of the emulator's side.
struct Topics {
    sensors: Publisher<Sensors>,
    applied: Publisher<Applied>,
    steps: Publisher<GuardStep>,
    events: Publisher<GuardEvent>,
    log: RunLog,
}

impl Topics {
    fn open(bench: &BenchMember) -> Result<Self, ProcessError> {
        Ok(Self {
            sensors: bench.publish(&SENSORS)?,
            applied: bench.publish(&APPLIED)?,
            steps: bench.publish(&GUARD_STEPS)?,
            events: bench.publish(&GUARD_EVENTS)?,
            log: RunLog::new(RecordSender::off()),
        })
    }
}

impl Interference for Topics {
    fn event(&mut self, event: &GuardEvent) {
        self.events.send(event);
        self.log.event(event);
    }

    fn guard_step(&mut self, step: &GuardStep) {
        self.sensors.send(&step.sensors);
        self.applied.send(&step.applied);
        self.steps.send(step);
    }
}

/// Runs the emulated bench and its guard for `seconds` of virtual time, asking the controller at each slot. The bench
/// is armed in its first slot. When the controller is gone it ends with the rotors at rest.
///
/// # Errors
/// A second emulator or bridge on the same bench; settings that cannot be.
pub fn conduct(
    config: &BenchConfig,
    seconds: f64,
    patience_s: f64,
    shutdown: &Shutdown,
) -> Result<LockstepSummary, ProcessError> {
    config.check()?;
    let guard = crate::runtime::guard::of_bench(config)?;
    let emulated =
        EmulatedBench::new(crate::runtime::emulate::emulator(config)?, Some(guard), config.period_s);
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Emulate)?;
    let mut line = Line::open(&bench, patience_s)?;
    let mut topics = Topics::open(&bench)?;
    let mut state = emulated.start();
    tracing::info!(bench = config.name, "emulate in lockstep: waits for `control --lockstep`");
    for _ in 0..emulated.slots(seconds) {
        let inputs = emulated.ask(&state, &mut topics);
        let command = line.ask(&inputs, shutdown);
        if shutdown.is_requested() {
            break;
        }
        if let Some(command) = command {
            let (sensors, applied) = (inputs.sensors, inputs.applied);
            topics.log.control_step(&ControlStep { sensors, applied, command });
        }
        let slot = emulated.take(&mut state, &inputs, command, &mut topics);
        topics.log.add(&slot);
        if line.is_gone && has_stopped(&slot) {
            break;
        }
    }
    line.end();
    Ok(topics.log.summary(config.period_s))
}

/// Whether the failsafe has brought the rotors to rest: nothing more can happen without a controller.
fn has_stopped(slot: &Slot) -> bool {
    let state = State::from_code(slot.applied.state).unwrap_or_default();
    !state.is_active() && slot.applied.rotor == [0.0; ROTORS]
}

/// What the controller's side ends with.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct AnswerSummary {
    /// Steps answered, each counted once.
    pub answered: u64,
    /// Whether the emulator ended its run; else it vanished, or this process was asked to end.
    pub complete: bool,
    /// How well the angle was held, in the last run that was answered.
    pub angle: AngleError,
}

/// The controller's side: answers each step until the run ends, until none has come for `patience_s`, or until
/// `shutdown`. Before the first step of all it waits as long as it takes.
///
/// # Errors
/// A second controller on the same bench.
pub fn answer(
    config: &BenchConfig,
    source: CommandSource,
    patience_s: f64,
    shutdown: &Shutdown,
) -> Result<AnswerSummary, ProcessError> {
    config.check()?;
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Control)?;
    let mut output = ControlOutput::open(&bench, source)?;
    let mut steps = bench.subscribe(&LOCKSTEP_STEPS)?;
    let mut answers = bench.publish(&LOCKSTEP_ANSWERS)?;
    let (guard_bell, bell) = (bench.bell(Waiter::Guard)?, bench.bell(Waiter::Control)?);
    let patience_ns = clock::span_ns(patience_s);
    let (mut last, mut answered) = (LockstepAnswer::default(), 0);
    let mut heard_ns = clock::monotonic_ns();
    let mut complete = false;
    while !shutdown.is_requested() && !complete {
        let now_ns = clock::monotonic_ns();
        if answered > 0 && now_ns.saturating_sub(heard_ns) > patience_ns {
            tracing::warn!("the emulator asks no more");
            break;
        }
        let _ = rt::wait([bell.descriptor()], now_ns.saturating_add(LOOK_NS));
        bell.quiet();
        while let Some(step) = steps.next_in_order() {
            heard_ns = clock::monotonic_ns();
            if step.number == 0 {
                complete |= step.run == last.run;
                continue;
            }
            // A step that is asked again is answered again, not computed again.
            if (step.run, step.number) != (last.run, last.number) {
                if step.run != last.run {
                    output.restart();
                }
                let command = output.step(step.now_ns, &step.sensors, &step.applied);
                output.publish(&step.sensors, &step.applied, &command);
                last = LockstepAnswer { run: step.run, number: step.number, command };
                answered += 1;
            }
            answers.send(&last);
            guard_bell.ring();
        }
    }
    Ok(AnswerSummary { answered, complete, angle: output.angle() })
}
