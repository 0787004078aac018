//! The emulated benches of the paper, run on virtual time.

use serde::Serialize;

use super::error::PaperError;
use super::settings::{IMPULSE, IMPULSE_AT_S, PERIOD_S, PaperSettings};
use crate::bench::BenchConfig;
use crate::clock;
use crate::control::design::{Compensator, DiscreteLoop};
use crate::control::{Compensation, ControllerConfig, ControllerKind};
use crate::emulate::Impulse;
use crate::experiment::{Experiment, ExperimentConfig, Rotors, Waveform};
use crate::guard::{Cause, State};
use crate::model::Model;
use crate::rt::Shutdown;
use crate::runtime::ProcessError;
use crate::runtime::command_source::CommandSource;
use crate::runtime::emulate::emulator;
use crate::runtime::experiment::prepare;
use crate::runtime::lockstep::{Interference, Lockstep, ORIGIN_NS};
use crate::runtime::trace::LogTrace;
use crate::runtime::{ExperimentPlan, controller_plant, guard};
use crate::screening::ScreenedLog;
use crate::signal::{ControlStep, Sensors};
use crate::studies::impulse_response::{ImpulseResponse, Moment, measure};
use crate::studies::thresholds::THRESHOLDS;

/// [s] from standstill to the first excited period.
const LEAD_IN_S: f64 = 4.0;
/// [s] that a bench runs beyond its experiment: the guard's checks at the start, the run-out at the end.
const SPARE_S: f64 = 3.0;
/// Added to the seed for the runs under control; the experiments' are those before.
const RUN_SEED: u64 = 100;
/// Steps between two words on progress.
const REPORT_SLOTS: u64 = 500;

/// One run under control.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct ControlledRun {
    /// `EMC` or `PID`.
    pub controller: &'static str,
    /// [s] transport delay in the loop.
    pub delay: f64,
    /// [s] transport delay from which `design` has the loop unstable.
    pub delay_limit: f64,
    /// How it answered.
    pub answer: ImpulseResponse,
    /// Period by period. The angle is the true one.
    #[serde(skip)]
    pub moments: Vec<Moment>,
}

/// One bench after another, and how far they are.
pub(crate) struct Benches<'a> {
    shutdown: &'a Shutdown,
    seed: u64,
    done: u64,
    steps: u64,
    all_steps: u64,
}

impl<'a> Benches<'a> {
    pub fn new(
        settings: &PaperSettings,
        experiments: &[(Waveform, &str)],
        runs: usize,
        shutdown: &'a Shutdown,
    ) -> Self {
        let slots =
            |shape: &Waveform| experiment_of(shape.clone()).build(PERIOD_S).map_or(0, |it| slots_of(&it));
        let experiments: u64 = experiments.iter().map(|(shape, _)| slots(shape)).sum();
        let runs = runs as u64
            * clock::span_ns(IMPULSE_AT_S + THRESHOLDS.answer_window_s).div_ceil(clock::span_ns(PERIOD_S));
        Self { shutdown, seed: settings.seed, done: 0, steps: 0, all_steps: experiments + runs }
    }

    /// Share of all steps that is done.
    pub fn share(&self) -> f64 {
        self.steps as f64 / self.all_steps.max(1) as f64
    }

    /// One rotor of a clamped bench, driven open loop.
    pub fn experiment(
        &mut self,
        shape: Waveform,
        name: &str,
        report: &mut dyn FnMut(&str, f64),
    ) -> Result<ScreenedLog, PaperError> {
        let config = self.held_bench();
        let plan = ExperimentPlan { closed_loop: false, experiment: experiment_of(shape) };
        let (experiment, source) = prepare(&config, &plan)?;
        let mut rows = Rows::new(&experiment);
        self.go_through(&config, source, slots_of(&experiment), name, &mut |step| rows.take(step), report)?;
        Ok(rows.trace.into_dataset(name)?.into())
    }

    /// The body struck once, held by `kind` as made for `model`.
    pub fn controlled_run(
        &mut self,
        controller: &'static str,
        kind: ControllerKind,
        delay: f64,
        model: &Model,
        report: &mut dyn FnMut(&str, f64),
    ) -> Result<ControlledRun, PaperError> {
        let (duration_s, torque) = IMPULSE;
        let mut config = self.bench();
        // The same noise for every controller.
        config.emulator.seed = self.seed.wrapping_add(RUN_SEED);
        config.emulator.command_delay_s = delay;
        config.emulator.impulse = vec![Impulse { at_s: IMPULSE_AT_S, duration_s, torque }];
        // An encoder without noise: what is measured is what really was. The controllers do not use it.
        let encoder = &mut config.emulator.sensors.body_angle;
        (encoder.rate_hz, encoder.noise, encoder.quantization) = (1.0 / PERIOD_S, 0.0, 0.0);
        let settings = ControllerConfig { kind, ..ControllerConfig::paper() };
        let (parameters, _) = controller_plant::of_model(model)?;
        let delay_limit = delay_limit(model, &settings)?;
        let source = CommandSource::controller(
            settings.build(&parameters, PERIOD_S)?,
            settings.reference.build(PERIOD_S)?,
        );
        let mut moments = Vec::new();
        let mut see = |ControlStep { sensors, command, .. }: &ControlStep| {
            let time = clock::span_s(command.stamp_ns.saturating_sub(ORIGIN_NS));
            let is_struck = (IMPULSE_AT_S..IMPULSE_AT_S + duration_s).contains(&time);
            moments.push(Moment {
                time,
                angle: sensors.body_angle.value,
                torque: command.torque,
                estimate: command.estimate.disturbance_torque,
                disturbance: if is_struck { torque } else { 0.0 },
            });
        };
        let slots =
            clock::span_ns(IMPULSE_AT_S + THRESHOLDS.answer_window_s).div_ceil(clock::span_ns(PERIOD_S));
        let name = format!("{controller} with {} ms of delay", 1e3 * delay);
        self.go_through(&config, source, slots, &name, &mut see, report)?;
        Ok(ControlledRun {
            controller,
            delay,
            delay_limit,
            answer: measure(&moments, IMPULSE_AT_S, THRESHOLDS.answer_window_s),
            moments,
        })
    }

    /// The next bench whose body is clamped.
    fn held_bench(&mut self) -> BenchConfig {
        let mut config = self.bench();
        config.emulator.integration_step_s = 0.004;
        config.hold_body();
        config.emulator.sensors = config.emulator.sensors.at_rate(1.0 / PERIOD_S);
        config
    }

    /// The next bench, of a seed of its own.
    fn bench(&mut self) -> BenchConfig {
        let mut config = BenchConfig { period_s: PERIOD_S, ..BenchConfig::default() };
        config.emulator.seed = self.seed.wrapping_add(self.done);
        self.done += 1;
        config
    }

    /// Runs `slots` periods behind the guard; `see` sees each.
    fn go_through(
        &mut self,
        config: &BenchConfig,
        source: CommandSource,
        slots: u64,
        what: &str,
        see: &mut dyn FnMut(&ControlStep),
        report: &mut dyn FnMut(&str, f64),
    ) -> Result<(), PaperError> {
        config.check().map_err(ProcessError::from)?;
        let guard = guard::of_bench(config)?;
        let bench = Lockstep::new(emulator(config)?, source, config.period_s).guarded(guard);
        let mut state = bench.start();
        for slot in 0..slots {
            if self.shutdown.is_requested() {
                return Err(PaperError::Interrupted {
                    what: what.to_owned(),
                    reason: self.shutdown.reason(),
                });
            }
            let mut seen = Seen::default();
            bench.step(&mut state, &mut seen);
            // What comes behind a latch is neither an experiment nor a run.
            if let Some((time_s, cause)) = stopped_by_guard(&seen.0) {
                return Err(PaperError::Stopped { what: what.to_owned(), time_s, cause });
            }
            see(&seen.0);
            self.steps += 1;
            if slot % REPORT_SLOTS == 0 {
                report(what, self.share());
            }
        }
        Ok(())
    }
}

/// What the controller saw and said in a slot.
#[derive(Default)]
struct Seen(ControlStep);

impl Interference for Seen {
    fn control_step(&mut self, step: &ControlStep) {
        self.0 = *step;
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
    // As run: the controllers cancel nothing here.
    let nothing = Compensation::default();
    let closed = DiscreteLoop::build(&parameters, &loop_plant, &compensator, &nothing, 0.0, PERIOD_S)?;
    Ok(closed.margins().delay_s)
}

/// When [s] and why the guard's latch stopped the rotors; `None` while it has not.
fn stopped_by_guard(step: &ControlStep) -> Option<(f64, Cause)> {
    let is_latched = State::from_code(step.applied.state) == Some(State::FailsafeLatched);
    let time_s = clock::span_s(step.command.stamp_ns.saturating_sub(ORIGIN_NS));
    is_latched.then(|| (time_s, Cause::from_code(step.applied.cause).unwrap_or_default()))
}

fn experiment_of(shape: Waveform) -> ExperimentConfig {
    ExperimentConfig { shape, rotors: Rotors::One, around: 0.4633, lead_in_s: LEAD_IN_S }
}

/// Steps of a bench that runs `experiment`.
fn slots_of(experiment: &Experiment) -> u64 {
    experiment.slots() + (SPARE_S / PERIOD_S).ceil() as u64
}

/// The log of an experiment, from its first excited slot to its last.
struct Rows {
    trace: LogTrace,
    lead_in: u64,
    slots: u64,
    done: u64,
    /// What was measured in the slot before; its commands come with this one's step.
    before: Option<(u64, Sensors)>,
}

impl Rows {
    fn new(experiment: &Experiment) -> Self {
        let (lead_in, slots) = (experiment.lead_in(), experiment.slots());
        Self { trace: LogTrace::default(), lead_in, slots, done: 0, before: None }
    }

    fn take(&mut self, step: &ControlStep) {
        if let Some((slot, sensors)) = self.before.take() {
            let time_ns = (slot - self.lead_in).saturating_mul(clock::span_ns(PERIOD_S));
            self.trace.push(time_ns, &sensors, &step.applied);
        }
        // As the command source counts: the experiment begins when the guard lets its first command through.
        self.done += u64::from(step.applied.command_sequence > 0);
        let slot = self.done.checked_sub(1).filter(|slot| (self.lead_in..self.slots).contains(slot));
        self.before = slot.map(|slot| (slot, step.sensors));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A seed with which the gyro of the first bench reads the same in seven periods on end, by chance, 42 s into the
    /// constant commands: what the guard of a free bench calls frozen.
    const FROZEN: u64 = 374;

    #[test]
    fn a_guard_that_stops_the_rotors_ends_the_run_with_the_cause() {
        let settings = PaperSettings { seed: FROZEN, prbs_s: 20.0, hold_s: 20.0 };
        let levels = vec![0.35, 0.4, 0.45, 0.5, 0.55, 0.6];
        let shape = Waveform::Constant { levels, hold_s: 20.0 };
        let shutdown = Shutdown::default();
        let go_through = |frozen_after_s: Option<f64>| {
            let mut benches = Benches::new(&settings, &[(shape.clone(), "constant commands")], 0, &shutdown);
            let mut config = benches.held_bench();
            config.guard.body_rate.frozen_after_s = frozen_after_s.or(config.guard.body_rate.frozen_after_s);
            let plan = ExperimentPlan { closed_loop: false, experiment: experiment_of(shape.clone()) };
            let (experiment, source) = prepare(&config, &plan).expect("an experiment");
            benches.go_through(
                &config,
                source,
                slots_of(&experiment),
                "constant commands",
                &mut |_| (),
                &mut |_, _| (),
            )
        };
        // On a body that is held a gyro that stands still stops nothing.
        assert!(go_through(None).is_ok());
        let error = go_through(Some(0.1)).expect_err("the seed is such a one").to_string();
        assert!(error.starts_with("constant commands: the guard stopped the rotors after 4"), "{error}");
        assert!(error.ends_with(" s: required signal is frozen"), "{error}");
    }
}
