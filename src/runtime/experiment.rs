//! `experiment`: a test signal through control and guard, on a running bench or on the emulated one in lockstep.

use std::path::Path;

use super::ProcessError;
use super::command_source::CommandSource;
use super::control;
use super::experiment_plan::ExperimentPlan;
use super::lockstep::{Interference, Lockstep};
use super::record::Background;
use super::thresholds::THRESHOLDS;
use super::trace::LogTrace;
use super::{controller_plant, guard};
use crate::bench::BenchConfig;
use crate::clock;
use crate::experiment::{Experiment, ExperimentError};
use crate::guard::{Cause, State};
use crate::rt::Shutdown;
use crate::shm::{APPLIED, BenchMember, ProcessRole};
use crate::signal::Applied;

/// How an experiment ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ending {
    /// It ran to its end.
    Complete,
    /// The operator stopped it.
    Stopped,
    /// The guard closed again, or never opened.
    GuardClosed {
        /// State of the guard.
        state: State,
        /// Cause of its last transition.
        cause: Cause,
    },
    /// Nothing was heard of the guard.
    GuardSilent {
        /// [s] for so long.
        after_s: f64,
    },
}

impl Ending {
    fn closed(applied: &Applied) -> Self {
        Self::GuardClosed {
            state: State::from_code(applied.state).unwrap_or_default(),
            cause: Cause::from_code(applied.cause).unwrap_or_default(),
        }
    }
}

/// Builds the experiment and holds it against the guard's limits.
///
/// # Errors
/// What cannot be, or the limit that would clip it.
pub fn prepare(
    config: &BenchConfig,
    plan: &ExperimentPlan,
) -> Result<(Experiment, CommandSource), ProcessError> {
    config.check()?;
    let experiment = plan.experiment.build(config.period_s)?;
    let guard = guard::of_bench(config)?;
    experiment.check(&guard.limits()).map_err(ExperimentError::from)?;
    let source = if plan.closed_loop {
        controller_plant::command_source(config)?.excited_by(experiment.clone())
    } else {
        CommandSource::experiment(experiment.clone())
    };
    Ok((experiment, source))
}

/// Runs `plan` on the emulated bench in virtual time. The log begins with the first excited slot; `progress` is
/// called with the share that is done, and stops the run by answering `false`.
///
/// # Errors
/// See [`prepare`]; settings of the emulator that cannot be.
pub fn in_lockstep(
    config: &BenchConfig,
    plan: &ExperimentPlan,
    interference: &mut impl Interference,
    mut progress: impl FnMut(f64) -> bool,
) -> Result<(LogTrace, Ending), ProcessError> {
    /// Slots between two words on progress.
    const REPORT_SLOTS: u64 = 5000;
    let (experiment, source) = prepare(config, plan)?;
    let guard = guard::of_bench(config)?;
    let bench = Lockstep::new(super::emulate::emulator(config)?, source, config.period_s).guarded(guard);
    let mut state = bench.start();
    let mut trace = LogTrace::default();
    let period_ns = clock::span_ns(config.period_s);
    let mut passed = 0;
    while !bench.is_finished(&state) {
        let slot = bench.step(&mut state, interference);
        if let Some(at) = bench.experiment_slot(&state) {
            passed = at + 1;
            if let Some(row) = at.checked_sub(experiment.lead_in()) {
                trace.push(row.saturating_mul(period_ns), &slot.sensors, &slot.applied);
            }
        }
        if has_closed(&slot.applied, passed, slot.slot, config) {
            return Ok((trace, Ending::closed(&slot.applied)));
        }
        if slot.slot.is_multiple_of(REPORT_SLOTS) && !progress(passed as f64 / experiment.slots() as f64) {
            return Ok((trace, Ending::Stopped));
        }
    }
    Ok((trace, Ending::Complete))
}

/// Whether an experiment cannot go on: the guard closed again, or never opened.
fn has_closed(applied: &Applied, passed: u64, slot: u64, config: &BenchConfig) -> bool {
    let is_active = State::from_code(applied.state).unwrap_or_default().is_active();
    let latest_s = config.guard.arm_timeout_s + THRESHOLDS.arming_grace_s;
    if passed == 0 { slot as f64 * config.period_s > latest_s } else { !is_active }
}

/// Runs `plan` on a running bench and records it; waits until the operator has armed, and calls `waiting` as that
/// begins. `progress` is called with the share that is done.
///
/// # Errors
/// See [`prepare`]; a bench that nobody guards, or that has a controller; a recording that is there already.
pub fn on_bench(
    config: &BenchConfig,
    plan: &ExperimentPlan,
    recording: &Path,
    shutdown: &Shutdown,
    waiting: impl FnOnce(),
    progress: impl FnMut(f64) + Send,
) -> Result<Ending, ProcessError> {
    let (experiment, source) = prepare(config, plan)?;
    super::operator::require_guard(config)?;
    let background = Background::start(config, recording, "experiment", Some(plan))?;
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Monitor)?;
    let applied = bench.subscribe(&APPLIED)?;
    waiting();
    let ended = Shutdown::default();
    let ending = std::thread::scope(|scope| {
        let watch = Watch { slots: experiment.slots(), period_s: config.period_s, shutdown, ended: &ended };
        let watcher = scope.spawn(move || watch.run(applied, progress));
        let ended_by = control::control(config, source, None, shutdown);
        ended.request();
        let ending = watcher.join().unwrap_or(Ending::Complete);
        ended_by.map(|_| ending)
    });
    let ending = match ending {
        Ok(ending) => ending,
        Err(refused) => {
            background.discard();
            return Err(refused);
        }
    };
    background.finish()?;
    Ok(ending)
}

/// Looks on at the guard while an experiment runs.
struct Watch<'a> {
    slots: u64,
    period_s: f64,
    shutdown: &'a Shutdown,
    ended: &'a Shutdown,
}

impl Watch<'_> {
    /// How the experiment ended.
    fn run(&self, mut applied: crate::shm::Subscriber<Applied>, mut progress: impl FnMut(f64)) -> Ending {
        let mut begun_ns = None;
        let mut share = 0.0;
        let span_s = self.slots as f64 * self.period_s;
        let mut heard_ns = clock::monotonic_ns();
        let mut is_logged = false;
        while !self.ended.is_requested() {
            std::thread::sleep(std::time::Duration::from_millis(20));
            let Some(applied) = applied.newest() else {
                if clock::span_s(clock::monotonic_ns().saturating_sub(heard_ns)) > THRESHOLDS.gone_s {
                    self.shutdown.request();
                    return Ending::GuardSilent { after_s: THRESHOLDS.gone_s };
                }
                continue;
            };
            heard_ns = clock::monotonic_ns();
            let state = State::from_code(applied.state).unwrap_or_default();
            if state == State::FailsafeLatched && begun_ns.is_none() && !is_logged {
                let cause = Cause::from_code(applied.cause).unwrap_or_default();
                tracing::warn!("the guard is latched ({cause}): `rotorbench disarm`, then `rotorbench arm`");
                is_logged = true;
            }
            if state.is_active() {
                let begun_ns = *begun_ns.get_or_insert(applied.stamp_ns);
                share = (clock::span_s(applied.stamp_ns.saturating_sub(begun_ns)) / span_s).min(1.0);
                progress(share);
            } else if begun_ns.is_some() && share < 1.0 {
                self.shutdown.request();
                return Ending::closed(&applied);
            }
        }
        if share < 1.0 { Ending::Stopped } else { Ending::Complete }
    }
}
