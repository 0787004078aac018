//! The emulated bench of the paper in a process of its own, and what flies it from this one.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Child, Command as Program, ExitStatus, Stdio};
use std::time::Duration;

use super::{Flight, IMPULSE, IMPULSE_AT_S, PERIOD_S, PaperError, PaperSettings};
use crate::bench::BenchConfig;
use crate::clock;
use crate::control::design::{Compensator, DiscreteLoop};
use crate::control::{Compensation, ControllerConfig, ControllerKind};
use crate::emulate::Impulse;
use crate::experiment::{Experiment, ExperimentConfig, Rotors, Shape};
use crate::guard::{Cause, State};
use crate::log::Dataset;
use crate::model::Model;
use crate::rt::Shutdown;
use crate::runtime::ProcessError;
use crate::runtime::command_source::Pilot;
use crate::runtime::controller_plant::{self, FlightPlan};
use crate::runtime::experiment::prepare;
use crate::runtime::lockstep::ORIGIN_NS;
use crate::runtime::lockstep::two_process;
use crate::runtime::trace::Trace;
use crate::shm::{PassingBench, leftovers};
use crate::signal::{Command, LockstepStep, Sensors};
use crate::studies::impulse_response::{JUDGED_S, Moment, judge};

/// [s] from standstill to the first excited period.
const LEAD_IN_S: f64 = 4.0;
/// [s] that a bench runs beyond its experiment: the guard's checks at the start, the run-out at the end.
const SPARE_S: f64 = 3.0;
/// [s] of the machine's clock without a step after which the emulator counts as gone; its end is noticed at once.
const PATIENCE_S: f64 = 60.0;
/// Added to the seed for the flights; the experiments' are those before.
const FLIGHT_SEED: u64 = 100;
/// Steps between two words on progress.
const TELL: u64 = 500;

/// [s] between two looks at the emulator's process and at the operator's wish.
const LOOK: Duration = Duration::from_millis(10);
/// What the name of each bench begins with; process and number come behind.
const STEM: &str = "paper-";

/// Removes what a run that was killed has left in shared memory.
pub(crate) fn clean_up_after_the_killed() {
    let is_ours = |name: &str| {
        let numbers = name.strip_prefix(STEM).and_then(|rest| rest.split_once('-'));
        numbers
            .is_some_and(|(process, flight)| process.parse::<u32>().is_ok() && flight.parse::<u32>().is_ok())
    };
    for left in leftovers().iter().filter(|left| is_ours(&left.bench)) {
        // `doctor --fix` has another chance.
        let _ = left.remove();
    }
}

/// One bench after another, and how far they are.
pub(crate) struct Benches<'a> {
    program: PathBuf,
    shutdown: &'a Shutdown,
    seed: u64,
    flown: u64,
    steps: u64,
    all_steps: u64,
}

impl<'a> Benches<'a> {
    pub fn new(
        settings: &PaperSettings,
        experiments: &[(Shape, &str)],
        flights: usize,
        shutdown: &'a Shutdown,
    ) -> Self {
        let slots =
            |shape: &Shape| experiment_of(shape.clone()).build(PERIOD_S).map_or(0, |it| slots_of(&it));
        let experiments: u64 = experiments.iter().map(|(shape, _)| slots(shape)).sum();
        let flights =
            flights as u64 * clock::span_ns(IMPULSE_AT_S + JUDGED_S).div_ceil(clock::span_ns(PERIOD_S));
        Self {
            program: settings.program.clone(),
            shutdown,
            seed: settings.seed,
            flown: 0,
            steps: 0,
            all_steps: experiments + flights,
        }
    }

    /// Share of all steps that is done.
    pub fn share(&self) -> f64 {
        self.steps as f64 / self.all_steps.max(1) as f64
    }

    /// One rotor of a clamped bench, driven open loop.
    pub fn experiment(
        &mut self,
        shape: Shape,
        name: &str,
        tell: &mut dyn FnMut(&str, f64),
    ) -> Result<Dataset, PaperError> {
        let mut config = self.bench();
        config.emulator.integration_step_s = 0.004;
        config.hold_body();
        config.emulator.sensors = config.emulator.sensors.at_rate(1.0 / PERIOD_S);
        let plan = FlightPlan { closed_loop: false, experiment: experiment_of(shape) };
        let (experiment, pilot) = prepare(&config, &plan)?;
        let mut rows = Rows::new(&experiment);
        self.fly(&config, pilot, slots_of(&experiment), name, &mut |step, _| rows.take(step), tell)?;
        Ok(rows.trace.into_dataset(name)?)
    }

    /// The body struck once, held by `kind` as made for `model`.
    pub fn flight(
        &mut self,
        controller: &'static str,
        kind: ControllerKind,
        delay: f64,
        model: &Model,
        tell: &mut dyn FnMut(&str, f64),
    ) -> Result<Flight, PaperError> {
        let (duration_s, torque) = IMPULSE;
        let mut config = self.bench();
        // The same noise for every controller.
        config.emulator.seed = self.seed.wrapping_add(FLIGHT_SEED);
        config.emulator.command_delay_s = delay;
        config.emulator.impulse = vec![Impulse { at_s: IMPULSE_AT_S, duration_s, torque }];
        // An encoder without noise: the judge sees what really was. The controllers do not use it.
        let encoder = &mut config.emulator.sensors.body_angle;
        (encoder.rate_hz, encoder.noise, encoder.quantization) = (1.0 / PERIOD_S, 0.0, 0.0);
        let settings = ControllerConfig { kind, ..ControllerConfig::paper() };
        let (parameters, _) = controller_plant::of_model(model)?;
        let delay_limit = delay_limit(model, &settings)?;
        let pilot =
            Pilot::controller(settings.build(&parameters, PERIOD_S)?, settings.reference.build(PERIOD_S)?);
        let mut moments = Vec::new();
        let mut see = |step: &LockstepStep, command: &Command| {
            let time = clock::span_s(step.now_ns.saturating_sub(ORIGIN_NS));
            let is_struck = (IMPULSE_AT_S..IMPULSE_AT_S + duration_s).contains(&time);
            moments.push(Moment {
                time,
                angle: step.sensors.body_angle.value,
                torque: command.torque,
                estimate: command.estimate.disturbance_torque,
                disturbance: if is_struck { torque } else { 0.0 },
            });
        };
        let slots = clock::span_ns(IMPULSE_AT_S + JUDGED_S).div_ceil(clock::span_ns(PERIOD_S));
        let name = format!("{controller} with {} ms of delay", 1e3 * delay);
        self.fly(&config, pilot, slots, &name, &mut see, tell)?;
        Ok(Flight {
            controller,
            delay,
            delay_limit,
            answer: judge(&moments, IMPULSE_AT_S, JUDGED_S),
            moments,
        })
    }

    /// The next bench, of a name of its own.
    fn bench(&mut self) -> BenchConfig {
        let name = format!("{STEM}{}-{}", std::process::id(), self.flown);
        let mut config = BenchConfig { name, period_s: PERIOD_S, ..BenchConfig::default() };
        config.emulator.seed = self.seed.wrapping_add(self.flown);
        self.flown += 1;
        config
    }

    /// Answers `slots` steps of an emulator that is started for it.
    fn fly(
        &mut self,
        config: &BenchConfig,
        pilot: Pilot,
        slots: u64,
        what: &str,
        see: &mut dyn FnMut(&LockstepStep, &Command),
        tell: &mut dyn FnMut(&str, f64),
    ) -> Result<(), PaperError> {
        let shutdown = self.shutdown;
        let start = |error| PaperError::Start { program: self.program.clone(), error };
        // Before the process, so that it goes after it.
        let _passing = PassingBench::open(&config.name, &config.shared_memory).map_err(ProcessError::from)?;
        let mut process = EmulatorProcess::start(&self.program, config, slots).map_err(start)?;
        let ended = Shutdown::default();
        let (before, mut answered) = (self.steps, 0);
        let mut stopped = None;
        let mut count = |step: &LockstepStep, command: &Command| {
            // What comes behind a latch is neither an experiment nor a flight.
            stopped = stopped.or_else(|| stopped_by_guard(step));
            if stopped.is_some() {
                return ended.request();
            }
            see(step, command);
            answered += 1;
            self.steps = before + answered;
            if answered % TELL == 1 {
                tell(what, self.share());
            }
        };
        let (flown, status) = std::thread::scope(|scope| {
            // An emulator that is no more asks nothing: without this, nobody would notice before it has begun.
            let watcher = scope.spawn(|| {
                let status = process.end_of(&[shutdown, &ended]);
                ended.request();
                status
            });
            let flown = two_process::answer_watched(config, pilot, PATIENCE_S, &ended, &mut count);
            (flown, watcher.join())
        });
        if shutdown.is_requested() {
            return Err(PaperError::Interrupted { what: what.to_owned(), reason: shutdown.reason() });
        }
        flown?;
        if let Some((time_s, cause)) = stopped {
            return Err(PaperError::Stopped { what: what.to_owned(), time_s, cause });
        }
        if answered < slots {
            let status = match status {
                Ok(Ok(status)) => status.to_string(),
                Ok(Err(error)) => error.to_string(),
                Err(_) => "unknown".to_owned(),
            };
            return Err(PaperError::Emulator { what: what.to_owned(), answered, status });
        }
        Ok(())
    }
}

/// [s] delay up to which the loop is stable, the model's own apart: what `design` says of it.
fn delay_limit(model: &Model, settings: &ControllerConfig) -> Result<f64, PaperError> {
    let (parameters, known) = controller_plant::of_model(model)?;
    let compensator = match settings.kind {
        ControllerKind::Emc => Compensator::Emc(settings.emc.gains(parameters.pole, PERIOD_S)?),
        ControllerKind::Pid => Compensator::Pid(settings.pid),
    };
    let loop_plant = controller_plant::loop_of_model(model, &parameters, &known, 0.0);
    // As flown: the controllers cancel nothing here.
    let nothing = Compensation::default();
    let closed = DiscreteLoop::build(&parameters, &loop_plant, &compensator, &nothing, 0.0, PERIOD_S)?;
    Ok(closed.margins().delay_s)
}

/// When [s] and why the guard's latch stopped the rotors; `None` while it has not.
fn stopped_by_guard(step: &LockstepStep) -> Option<(f64, Cause)> {
    let is_latched = State::from_code(step.applied.state) == Some(State::FailsafeLatched);
    let time_s = clock::span_s(step.now_ns.saturating_sub(ORIGIN_NS));
    is_latched.then(|| (time_s, Cause::from_code(step.applied.cause).unwrap_or_default()))
}

fn experiment_of(shape: Shape) -> ExperimentConfig {
    ExperimentConfig { shape, rotors: Rotors::One, around: 0.4633, lead_in_s: LEAD_IN_S }
}

/// Steps of a bench that flies `experiment`.
fn slots_of(experiment: &Experiment) -> u64 {
    experiment.slots() + (SPARE_S / PERIOD_S).ceil() as u64
}

/// The log of an experiment, from its first excited slot to its last.
struct Rows {
    trace: Trace,
    lead_in: u64,
    slots: u64,
    flown: u64,
    /// What was measured in the slot before; its commands come with this one's step.
    before: Option<(u64, Sensors)>,
}

impl Rows {
    fn new(experiment: &Experiment) -> Self {
        let (lead_in, slots) = (experiment.lead_in(), experiment.slots());
        Self { trace: Trace::default(), lead_in, slots, flown: 0, before: None }
    }

    fn take(&mut self, step: &LockstepStep) {
        if let Some((slot, sensors)) = self.before.take() {
            let time_ns = (slot - self.lead_in).saturating_mul(clock::span_ns(PERIOD_S));
            self.trace.push(time_ns, &sensors, &step.applied);
        }
        // As the pilot counts: the experiment begins when the guard lets its first command through.
        self.flown += u64::from(step.applied.command_sequence > 0);
        let slot = self.flown.checked_sub(1).filter(|slot| (self.lead_in..self.slots).contains(slot));
        self.before = slot.map(|slot| (slot, step.sensors));
    }
}

/// The emulator's process; ends with this one, however this one ends.
struct EmulatorProcess(Child);

impl EmulatorProcess {
    /// Its bench file comes through standard input: nothing to clean up.
    fn start(program: &PathBuf, config: &BenchConfig, slots: u64) -> std::io::Result<Self> {
        let seconds = (slots as f64 * PERIOD_S).to_string();
        let text = toml::to_string(config).map_err(std::io::Error::other)?;
        let mut child = Program::new(program)
            .args(["emulate", "--shm", "--lockstep", "--json", "--seconds", &seconds])
            .args(["--config", "/dev/stdin"])
            .env("ROTORBENCH_LOG", "warn")
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()?;
        let stdin = child.stdin.take();
        let mut process = Self(child);
        if let Some(mut stdin) = stdin {
            // A child that refuses to read has its own word to say, and its end is seen.
            let _ = stdin.write_all(text.as_bytes());
        }
        let _ = process.0.try_wait()?;
        Ok(process)
    }

    /// Waits for its end, and brings it about when one of `wishes` says so.
    fn end_of(&mut self, wishes: &[&Shutdown]) -> std::io::Result<ExitStatus> {
        loop {
            if let Some(status) = self.0.try_wait()? {
                return Ok(status);
            }
            if wishes.iter().any(|wish| wish.is_requested()) {
                self.0.kill()?;
                return self.0.wait();
            }
            std::thread::sleep(LOOK);
        }
    }
}

impl Drop for EmulatorProcess {
    fn drop(&mut self) {
        // Already waited for, unless this process is on its way out; then nothing must be left running.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
