//! `run --lockstep`: the whole bench in one thread on virtual time, as fast as it can. The same bench file gives the
//! same bits, run after run, and the same as `emulate --shm --lockstep` with `control --lockstep` beside it.

use std::path::Path;

use super::digest::Digest;
use super::{Interference, Lockstep, ORIGIN_NS, Slot};
use crate::bench::BenchConfig;
use crate::clock;
use crate::guard::{Cause, State};
use crate::recording::{RecordSender, Recorder, RecorderOptions, RecorderSummary};
use crate::rt::Shutdown;
use crate::runtime::ProcessError;
use crate::runtime::control_output::AngleError;
use crate::runtime::record::metadata;
use crate::runtime::run::EventLine;
use crate::runtime::{controller_plant, guard};
use crate::signal::{ControlStep, GuardEvent, GuardStep, ROTORS};

/// Seconds of a run that names none.
pub const DEFAULT_S: f64 = 60.0;

/// What a run on virtual time ends with.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LockstepSummary {
    /// Slots run.
    pub slots: u64,
    /// Slots that the controller answered.
    pub answered: u64,
    /// [s] of virtual time.
    pub duration_s: f64,
    /// [s] that it took.
    pub wall_s: f64,
    /// How well the angle was held.
    pub angle: AngleError,
    /// State of the guard at the end.
    pub state: String,
    /// Cause of its last transition.
    pub cause: String,
    /// What the rotors got last.
    pub rotor: [f64; ROTORS],
    /// What the guard decided and refused, in order.
    pub guard_events: Vec<EventLine>,
    /// SHA-256 of everything measured, wanted, let through and true, slot by slot: the same bits, the same digest.
    pub digest: String,
    /// What was recorded.
    #[serde(skip)]
    pub recorded: Option<RecorderSummary>,
}

/// Sees a run go by: sums it up, and hands it to a recorder.
#[derive(Debug)]
pub(crate) struct RunLog {
    began_ns: u64,
    slots: u64,
    answered: u64,
    digest: Digest,
    last: Option<Slot>,
    angle: AngleError,
    events: Vec<EventLine>,
    recorder: RecordSender,
}

impl RunLog {
    pub(crate) fn new(recorder: RecordSender) -> Self {
        Self {
            began_ns: clock::monotonic_ns(),
            slots: 0,
            answered: 0,
            digest: Digest::default(),
            last: None,
            angle: AngleError::default(),
            events: Vec::new(),
            recorder,
        }
    }

    pub(crate) fn add(&mut self, slot: &Slot) {
        self.slots += 1;
        self.answered += u64::from(slot.command.is_some());
        self.digest.add(slot);
        self.last = Some(*slot);
    }

    pub(crate) fn summary(self, period_s: f64) -> LockstepSummary {
        let applied = self.last.map(|slot| slot.applied).unwrap_or_default();
        LockstepSummary {
            slots: self.slots,
            answered: self.answered,
            duration_s: self.slots as f64 * period_s,
            wall_s: clock::span_s(clock::monotonic_ns().saturating_sub(self.began_ns)),
            angle: self.angle,
            state: State::from_code(applied.state).unwrap_or_default().to_string(),
            cause: Cause::from_code(applied.cause).unwrap_or_default().to_string(),
            rotor: applied.rotor,
            guard_events: self.events,
            digest: self.digest.text(),
            recorded: None,
        }
    }
}

impl Interference for RunLog {
    fn event(&mut self, event: &GuardEvent) {
        self.events.push(EventLine::new(event, ORIGIN_NS));
        self.recorder.event(event);
    }

    fn control_step(&mut self, step: &ControlStep) {
        self.angle.see(&step.sensors, &step.applied, &step.command);
        self.recorder.control_step(step);
    }

    fn guard_step(&mut self, step: &GuardStep) {
        self.recorder.guard_step(step);
    }
}

/// Runs the emulated bench for `seconds` of virtual time, until `shutdown`; into a new `recording`, if one is named.
/// The bench is armed in its first slot.
///
/// # Errors
/// Settings that cannot be; a recording that is there already, or a disk that fails.
pub fn run(
    config: &BenchConfig,
    seconds: f64,
    recording: Option<&Path>,
    shutdown: &Shutdown,
) -> Result<LockstepSummary, ProcessError> {
    config.check()?;
    let guard = guard::of_bench(config)?;
    let source = controller_plant::command_source(config)?;
    let bench =
        Lockstep::new(crate::runtime::emulate::emulator(config)?, source, config.period_s).guarded(guard);
    let recorder = match recording {
        Some(path) => {
            Some(Recorder::start(path, &metadata(config, "run", None)?, RecorderOptions::default())?)
        }
        None => None,
    };
    let mut log = RunLog::new(recorder.as_ref().map_or_else(RecordSender::off, Recorder::sender));
    let mut state = bench.start();
    for _ in 0..bench.slots(seconds) {
        let slot = bench.step(&mut state, &mut log);
        log.add(&slot);
        if shutdown.is_requested() || recorder.as_ref().is_some_and(Recorder::has_failed) {
            break;
        }
    }
    let mut summary = log.summary(config.period_s);
    summary.recorded = recorder.map(Recorder::finish).transpose()?;
    Ok(summary)
}
