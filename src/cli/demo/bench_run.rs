//! One run of the demo: the emulator in a process of its own, the controller here, shared memory between them.

use std::fs;
use std::path::Path;
use std::process::{Child, Command as Program, Stdio};
use std::time::Duration;

use crate::bench::BenchConfig;
use crate::cancel::Cancel;
use crate::cli::CliError;
use crate::cli::progress::{self, ProgressLine};
use crate::cli::thresholds::THRESHOLDS;
use crate::cli::usage_error::UsageError;
use crate::clock;
use crate::file::write_atomically;
use crate::guard::{Cause, State};
use crate::log::Dataset;
use crate::recording::{RecordedItem, Recording};
use crate::report;
use crate::rt::Shutdown;
use crate::runtime::control::{self, ControlSummary};
use crate::runtime::controller_plant;
use crate::runtime::record::Background;
use crate::session::{self, Job, OpenConfig};
use crate::shm::{APPLIED, BenchMember, CONTROL_STEPS, ProcessRole};
use crate::signal::{ControlStep, GuardEvent};

/// [s] that the guard holds a command in the runs that are tried until one comes to its end: as everywhere in the
/// first. Where the machine stands still for longer, it waits longer in the next: only emulated rotors turn, and a demo
/// that asks for a quiet machine shows nothing on a shared one.
const HOLDS_S: [f64; 3] = [0.1, 0.3, 0.5];
/// [s] that the bench runs, each time.
const RUN_S: f64 = 19.0;
/// [s] that the emulator outlives the run: the guard must be seen to stop the rotors.
const AFTER_S: f64 = 1.0;

/// One run.
pub struct DemoRun {
    /// What the controller's process says at its end.
    pub summary: ControlSummary,
    /// Every step of the controller.
    pub steps: Vec<ControlStep>,
    /// Every change of the guard's state.
    pub events: Vec<GuardEvent>,
    /// The recording as a log.
    pub log: Dataset,
    /// [s] how long the guard held a command.
    pub hold_s: f64,
}

/// The emulator's process; ends with this one, however this one ends.
struct EmulatorProcess(Child);

impl EmulatorProcess {
    fn start(config: &BenchConfig, out: &Path) -> Result<Self, CliError> {
        let file = out.join("emulator.toml");
        write_atomically(&file, toml::to_string(config)?.as_bytes()).map_err(UsageError::at(&file))?;
        let seconds = RUN_S + AFTER_S;
        let program = std::env::current_exe()?;
        let child = Program::new(program)
            .args(["emulate", "--shm", "--arm", "--json", "--seconds", &seconds.to_string(), "--config"])
            .arg(&file)
            .env("ROTORBENCH_LOG", "warn")
            .stdout(Stdio::null())
            .spawn()?;
        Ok(Self(child))
    }

    /// Waits for its end; a failure is this command's failure.
    fn finish(mut self) -> Result<(), CliError> {
        let status = self.0.wait()?;
        if status.success() { Ok(()) } else { Err(UsageError::Emulator(status).into()) }
    }
}

impl Drop for EmulatorProcess {
    fn drop(&mut self) {
        // Already waited for, unless this process is on its way out; then nothing must be left running.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The loop in real time: emulator in a process of its own, EMC here, shared memory between them.
fn run_once(
    bench: &BenchConfig,
    emulator: &BenchConfig,
    out: &Path,
    name: &str,
    shutdown: &Shutdown,
) -> Result<DemoRun, CliError> {
    let source = controller_plant::command_source(bench)?;
    let recording = out.join(name).with_extension("mcap");
    if recording.exists() {
        fs::remove_file(&recording).map_err(UsageError::at(&recording))?;
    }
    let background = Background::start(bench, &recording, "demo", None)?;
    let process = EmulatorProcess::start(emulator, out)?;
    let ended = Shutdown::default();
    let summary = std::thread::scope(|scope| {
        scope.spawn(|| watch(bench, &ended));
        let summary = control::control(bench, source, Some(RUN_S), shutdown);
        ended.request();
        summary
    })?;
    process.finish()?;
    background.finish()?;
    let opened = session::open(&recording, &OpenConfig::default(), &Job::unwatched(&Cancel::default()))?;
    let log = opened.log.raw().clone();
    session::save_log(&log, &out.join(name).with_extension("csv"))?;
    let (steps, events) = steps_and_events(&recording)?;
    Ok(DemoRun { summary, steps, events, log, hold_s: bench.guard.hold_s })
}

/// The live line.
fn watch(bench: &BenchConfig, ended: &Shutdown) {
    let Ok(bench) = BenchMember::join(&bench.name, &bench.shared_memory, ProcessRole::Monitor) else {
        return;
    };
    let (Ok(mut steps), Ok(mut applied)) = (bench.subscribe(&CONTROL_STEPS), bench.subscribe(&APPLIED))
    else {
        return;
    };
    let progress = ProgressLine::start();
    let start_ns = clock::monotonic_ns();
    while !ended.is_requested() {
        std::thread::sleep(Duration::from_millis(50));
        let now_s = clock::span_s(clock::monotonic_ns().saturating_sub(start_ns));
        if let (Some(ControlStep { command, .. }), Some(applied)) = (steps.newest(), applied.newest()) {
            progress.line(|| {
                report::demo::live_line(
                    &progress::bar(now_s / RUN_S, 24),
                    now_s,
                    &command.estimate,
                    applied.rotor,
                )
            });
        }
    }
}

/// The controller's steps and the guard's events, from the recording.
fn steps_and_events(recording: &Path) -> Result<(Vec<ControlStep>, Vec<GuardEvent>), CliError> {
    let (mut steps, mut events) = (Vec::new(), Vec::new());
    for record in Recording::open(recording)? {
        match record? {
            RecordedItem::ControlStep(step) => steps.push(step),
            RecordedItem::GuardEvent(event) => events.push(event),
            _ => {}
        }
    }
    Ok((steps, events))
}

/// [s] from the controller's first step.
fn after_s(event: &GuardEvent, run: &DemoRun) -> f64 {
    let begun_ns = run.steps.first().map_or(0, |step| step.command.stamp_ns);
    (i128::from(event.stamp_ns) - i128::from(begun_ns)) as f64 * 1e-9
}

/// What a machine that stood still gives on a bench whose processes all run.
const LATE_CAUSES: [Cause; 7] = [
    Cause::TooManyMisses,
    Cause::CommandMissing,
    Cause::CommandExpired,
    Cause::CommandAnswersOldSensors,
    Cause::SignalNever,
    Cause::SignalStale,
    Cause::GuardPaused,
];
/// What an undisturbed run gives.
const ORDINARY_CAUSES: [Cause; 6] = [
    Cause::None,
    Cause::OperatorArm,
    Cause::OperatorDisarm,
    Cause::ChecksPassed,
    Cause::Recovered,
    Cause::Shutdown,
];

/// Whether the guard opened too late, or closed before the controller ended at `end_s`, and lateness was all it ever
/// found: a value that is wrong, or a controller that swings, is reported as what it is. `events` with their times [s].
fn was_held_up(events: &[(f64, GuardEvent)], end_s: f64) -> bool {
    let is_open = |code| State::from_code(code).is_some_and(State::is_active);
    let during = || events.iter().filter(|(at_s, _)| *at_s < end_s);
    let opens_s = events.iter().find(|(_, it)| !is_open(it.from) && is_open(it.to)).map(|(at_s, _)| *at_s);
    let closes = during().any(|(_, it)| is_open(it.from) && !is_open(it.to));
    let is_known = |cause| LATE_CAUSES.contains(&cause) || ORDINARY_CAUSES.contains(&cause);
    let only_late = during().all(|(_, it)| Cause::from_code(it.cause).is_some_and(is_known));
    only_late && (closes || opens_s.is_none_or(|opens_s| opens_s > THRESHOLDS.open_at_latest_s))
}

/// [of the run] in which the guard was degraded: some of the commands were held.
pub fn degraded(run: &DemoRun) -> f64 {
    let is_degraded = |code| State::from_code(code) == Some(State::Degraded);
    let mut since_s = None;
    let mut sum_s = 0.0;
    for event in &run.events {
        let now_s = after_s(event, run);
        if let Some(since_s) = since_s.take() {
            sum_s += now_s - since_s;
        }
        since_s = is_degraded(event.to).then_some(now_s);
    }
    sum_s / RUN_S
}

/// How the attempts at a run ended.
pub enum Attempts {
    /// The guard let one come to its end.
    Whole(Box<DemoRun>),
    /// It ended each before its time, because the machine stood still.
    HeldUp,
    /// The user did not want to wait.
    Interrupted,
}

/// Runs until the guard lets a run come to its end, a few times at most, and without less patience than `least_hold_s`. What the
/// guard said is printed.
pub fn run_whole(
    bench: &BenchConfig,
    emulator: &BenchConfig,
    out: &Path,
    (name, least_hold_s): (&str, f64),
    user: &Shutdown,
) -> Result<Attempts, CliError> {
    let (mut bench, mut emulator) = (bench.clone(), emulator.clone());
    for hold_s in HOLDS_S.into_iter().filter(|hold_s| *hold_s >= least_hold_s) {
        bench.guard.hold_s = hold_s;
        emulator.guard.hold_s = hold_s;
        // A controller that has ended asks for everybody's end: each run has its own.
        let ended = run_once(&bench, &emulator, out, name, &Shutdown::listen()?);
        if user.is_interrupted() {
            return Ok(Attempts::Interrupted);
        }
        let run = ended?;
        guard_lines(&run, &bench).iter().for_each(|line| println!("{line}"));
        let timed: Vec<_> = run.events.iter().map(|event| (after_s(event, &run), *event)).collect();
        if !was_held_up(&timed, RUN_S - bench.period_s) {
            return Ok(Attempts::Whole(Box::new(run)));
        }
        println!("{}", report::demo::stood_still(hold_s));
    }
    Ok(Attempts::HeldUp)
}

/// What the guard said, and when after the first step of the controller [s].
pub fn guard_lines(run: &DemoRun, bench: &BenchConfig) -> Vec<String> {
    let line = |event: &GuardEvent| {
        let after_s = after_s(event, run);
        report::demo::guard_line(after_s, event, after_s > RUN_S - bench.period_s)
    };
    run.events.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event((at_s, from, to, cause): (f64, State, State, Cause)) -> (f64, GuardEvent) {
        let [from, to, cause] = [from as u32, to as u32, cause as u32];
        (at_s, GuardEvent { from, to, cause, ..GuardEvent::default() })
    }

    #[test]
    fn only_a_run_that_lateness_ended_is_run_again() {
        let armed = (0.2, State::Disarmed, State::Armed, Cause::ChecksPassed);
        let late = (5.0, State::Armed, State::Degraded, Cause::CommandMissing);
        let held_up =
            |events: &[_]| was_held_up(&events.iter().copied().map(event).collect::<Vec<_>>(), 18.99);
        let latched = |at_s, cause| (at_s, State::Degraded, State::FailsafeLatched, cause);
        assert!(!held_up(&[armed, late, latched(19.1, Cause::CommandMissing)]), "it came to its end");
        for cause in [Cause::GuardPaused, Cause::CommandMissing, Cause::TooManyMisses] {
            assert!(held_up(&[armed, late, latched(5.1, cause)]), "{cause:?}");
        }
        assert!(held_up(&[]), "it never opened");
        assert!(
            held_up(&[(9.0, State::Disarmed, State::Armed, Cause::ChecksPassed)]),
            "too late for the first blow"
        );
        assert!(!held_up(&[armed, latched(5.1, Cause::Oscillation)]), "a controller's own fault");
        let wrong = (4.0, State::Armed, State::Degraded, Cause::SignalOutOfRange);
        assert!(
            !held_up(&[armed, wrong, latched(5.1, Cause::TooManyMisses)]),
            "misses that were wrong values"
        );
        let refused = (2.2, State::PreArm, State::Disarmed, Cause::SignalOutOfRange);
        assert!(!held_up(&[refused]), "never opened, and not for lateness");
    }
}
