//! Recorded runs side by side: the same disturbance through several controllers.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::impulse_response::{ImpulseResponse, Moment, measure};
use super::strike::nothing_stands_out;
use super::thresholds::THRESHOLDS;
use crate::bench::BenchConfig;
use crate::clock;
use crate::control::code;
use crate::emulate::Impulse;
use crate::recording::{RecordError, RecordedItem, Recording};
use crate::runtime::lockstep::ORIGIN_NS;
use crate::screening::Finding;
use crate::signal::ControlStep;
use crate::signal::columns;

/// Why runs cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum RunComparisonError {
    /// The recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// It holds no run.
    #[error("{}: no step of a controller with the guard open; record one with `run` or `control`", path.display())]
    NoRun {
        /// The file.
        path: PathBuf,
    },
    /// Nothing struck the body.
    #[error(
        "{}: nothing struck the body in this run, as its recording says, so there is no response to measure; run again with \
         --impulse AT:DURATION:TORQUE",
        path.display()
    )]
    NotStruck {
        /// The file.
        path: PathBuf,
    },
    /// Its angle does not show it.
    #[error(
        "{}: nothing says that the body was struck, and its angle does not show it: {largest_rad:.1e} rad at most where \
         {usual_rad:.1e} rad (rms) are usual; say when, with --impulse AT:DURATION:TORQUE", path.display()
    )]
    NoStrikeShows {
        /// The file.
        path: PathBuf,
        /// [rad] the largest angle, less its reference.
        largest_rad: f64,
        /// [rad] the rms of a noise with the median of the angle's size before that.
        usual_rad: f64,
    },
    /// It ends too early.
    #[error("{}: struck at {struck_s:.2} s, but the run lasts from {from_s:.2} to {to_s:.2} s only", path.display())]
    NothingBehind {
        /// The file.
        path: PathBuf,
        /// [s] when it was struck.
        struck_s: f64,
        /// [s] its first moment.
        from_s: f64,
        /// [s] its last one.
        to_s: f64,
    },
}

/// How it is known when the body was struck.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StruckFrom {
    /// Given by who compares.
    Given,
    /// The emulator's settings in the recording, which was made in virtual time.
    Recording,
    /// The moment from which the angle moves to its largest value.
    Angle,
}

/// The response to an impulse behind the first one.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct LaterStrike {
    /// [s] when the body was struck, since the run's clock began.
    pub struck_s: f64,
    /// What struck it.
    pub impulse: Impulse,
    /// [s] how long it was judged.
    #[serde(rename = "judged_s")]
    pub window_s: f64,
    /// How the controller answered.
    pub answer: ImpulseResponse,
}

/// One recorded run.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct RecordedRun {
    /// File name.
    pub recording: String,
    /// `EMC` or `PID`; `controller N` of a code N that this version does not know.
    pub controller: String,
    /// [s] transport delay of the emulated bench; absent where the recording does not say it.
    pub delay: Option<f64>,
    /// [s] when the body was struck, since the run's clock began.
    pub struck_s: f64,
    /// How that is known.
    pub struck_from: StruckFrom,
    /// The impulse, where it is known.
    pub impulse: Option<Impulse>,
    /// [s] how long behind the impulse it was judged: at most `window_s`.
    #[serde(rename = "judged_s")]
    pub window_s: f64,
    /// Whether the angle was measured at the pivot; else it is the controller's own estimate.
    pub is_angle_measured: bool,
    /// How the controller answered.
    pub answer: ImpulseResponse,
    /// The impulses behind the first one.
    pub later: Vec<LaterStrike>,
    /// What the recording says of it, where that is something else than was given.
    #[serde(skip)]
    pub recorded_otherwise: Option<Finding>,
    /// Period by period.
    #[serde(skip)]
    pub moments: Vec<Moment>,
}

/// Several runs, and what the reader must know of them.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct RunComparison {
    /// In the order given.
    pub runs: Vec<RecordedRun>,
    /// What makes them unlike each other, or is not known of them.
    pub findings: Vec<Finding>,
}

/// Reads the runs in `recordings` and measures each response over `window_s` behind its impulse as `paper` does, or over the time
/// that all of them have before the next impulse or their end: what drifts back over the band long after is no answer
/// to it. `given` is the impulse, `at_s` counted from the first record of a controller's step, where the recordings do
/// not say it.
///
/// # Errors
/// [`RunComparisonError`] naming the file.
pub fn compare_runs(
    recordings: &[PathBuf],
    given: Option<Impulse>,
) -> Result<RunComparison, RunComparisonError> {
    let mut raw = recordings.iter().map(|path| RawRun::read(path, given)).collect::<Result<Vec<_>, _>>()?;
    let most = raw.iter().map(|run| run.strikes.len()).max().unwrap_or(0);
    let window = |index: usize| {
        raw.iter().filter_map(|it| it.behind_s(index)).fold(THRESHOLDS.answer_window_s, f64::min)
    };
    let windows: Vec<f64> = (0..most).map(window).collect();
    let runs: Vec<RecordedRun> = raw.drain(..).map(|run| run.judged(&windows)).collect();
    let findings = findings(&runs);
    Ok(RunComparison { runs, findings })
}

/// A run before its responses are measured.
struct RawRun {
    path: PathBuf,
    config: Option<BenchConfig>,
    is_virtual: bool,
    is_angle_measured: bool,
    controller: String,
    moments: Vec<Moment>,
    struck_from: StruckFrom,
    recorded_otherwise: Option<Finding>,
    /// [s] when each impulse began, in order, where impulses are known.
    impulses: Vec<(f64, Impulse)>,
    /// [s] when the body was struck; impulses that follow each other too closely to be judged are one strike.
    strikes: Vec<f64>,
}

impl RawRun {
    fn read(path: &Path, given: Option<Impulse>) -> Result<Self, RunComparisonError> {
        let mut recording = Recording::open(path)?;
        let mut steps = Vec::new();
        for record in recording.by_ref() {
            if let RecordedItem::ControlStep(step) = record? {
                steps.push(step);
            }
        }
        // A recording of another version still holds a run.
        let config: Option<BenchConfig> = toml::from_str(&recording.metadata().bench).ok();
        // Nobody's monotonic clock is that young when a bench starts.
        let is_virtual = steps.first().is_some_and(|step| step.command.stamp_ns < 2 * ORIGIN_NS);
        let begun_ns = if is_virtual { ORIGIN_NS } else { steps.first().map_or(0, |it| it.command.stamp_ns) };
        steps.retain(|step| step.applied.command_sequence > 0 && step.command.controller != code::EXPERIMENT);
        let Some(last) = steps.last() else {
            return Err(RunComparisonError::NoRun { path: path.to_owned() });
        };
        let controller = code::name(last.command.controller);
        let is_angle_measured = steps.iter().all(|step| step.sensors.body_angle.is_good());
        let moments = steps.iter().map(|step| moment(step, begun_ns, is_angle_measured)).collect();
        let mut run = Self {
            path: path.to_owned(),
            config,
            is_virtual,
            is_angle_measured,
            controller,
            moments,
            struck_from: StruckFrom::Given,
            recorded_otherwise: None,
            impulses: Vec::new(),
            strikes: Vec::new(),
        };
        run.find_the_impulses(given);
        let (from_s, to_s) = run.span();
        let struck_s = run.strikes.first().copied().unwrap_or(f64::NAN);
        if run.struck_from == StruckFrom::Angle {
            if run.was_left_alone() {
                return Err(RunComparisonError::NotStruck { path: run.path });
            }
            if let Some((largest_rad, usual_rad)) = nothing_stands_out(&run.moments, struck_s) {
                return Err(RunComparisonError::NoStrikeShows { path: run.path, largest_rad, usual_rad });
            }
        }
        if struck_s < from_s || run.behind_s(0).is_none_or(|behind| behind < THRESHOLDS.shortest_answer_s) {
            return Err(RunComparisonError::NothingBehind { path: run.path, struck_s, from_s, to_s });
        }
        run.know_the_disturbance();
        Ok(run)
    }

    fn span(&self) -> (f64, f64) {
        let time = |moment: Option<&Moment>| moment.map_or(0.0, |moment| moment.time);
        (time(self.moments.first()), time(self.moments.last()))
    }

    /// [s] that can be judged behind a strike: until the next one, or the end.
    fn behind_s(&self, index: usize) -> Option<f64> {
        let struck_s = self.strikes.get(index)?;
        let until_s = self.strikes.get(index + 1).copied().unwrap_or(f64::INFINITY);
        Some(self.span().1.min(until_s) - struck_s)
    }

    fn find_the_impulses(&mut self, given: Option<Impulse>) {
        self.impulses = self.recorded_impulses();
        if let Some(impulse) = given {
            self.recorded_otherwise = self.recorded_otherwise(&impulse);
            self.impulses.retain(|(at_s, _)| *at_s > impulse.at_s);
            self.impulses.insert(0, (impulse.at_s, impulse));
        } else if self.impulses.is_empty() {
            self.struck_from = StruckFrom::Angle;
            self.strikes.push(self.onset());
        } else {
            self.struck_from = StruckFrom::Recording;
        }
        for &(at_s, _) in &self.impulses {
            if self.strikes.last().is_none_or(|last| at_s - last >= THRESHOLDS.shortest_answer_s) {
                self.strikes.push(at_s);
            }
        }
    }

    /// Whether the recording says all that moved the body, and that is nothing.
    fn was_left_alone(&self) -> bool {
        let config = self.config.as_ref().filter(|_| self.is_virtual);
        config.is_some_and(|it| it.emulator.impulse.is_empty() && it.controller.reference.moves.is_empty())
    }

    /// What the recording says struck the body, where it says so and it is not what was `given`.
    fn recorded_otherwise(&self, given: &Impulse) -> Option<Finding> {
        // As floating-point numbers from the same text they are equal to the last bit.
        let is_given = |(at_s, it): &(f64, Impulse)| Impulse { at_s: *at_s, ..*it } == *given;
        if self.impulses.iter().any(is_given) {
            return None;
        }
        let found = |code| {
            Finding::new(code, "impulse")
                .of(&self.name())
                .with("torque_nm", given.torque)
                .with("duration_s", given.duration_s)
                .with("at_s", given.at_s)
        };
        match self.impulses.first() {
            Some((at_s, first)) => Some(
                found("recorded_impulse_differs")
                    .with("recorded_torque_nm", first.torque)
                    .with("recorded_duration_s", first.duration_s)
                    .with("recorded_at_s", *at_s),
            ),
            None => self.was_left_alone().then(|| found("no_impulse_recorded")),
        }
    }

    /// File name of the recording.
    fn name(&self) -> String {
        self.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    /// The emulator's impulses up to the end of the run, in order, where they were recorded on the run's clock.
    fn recorded_impulses(&self) -> Vec<(f64, Impulse)> {
        let Some(config) = self.config.as_ref().filter(|_| self.is_virtual) else { return Vec::new() };
        let (emulator, to_s) = (&config.emulator, self.span().1);
        // A run has no more impulses than moments.
        let rounds = if emulator.impulse_period_s > 0.0 { self.moments.len() } else { 1 };
        let each = emulator.impulse.iter().flat_map(|impulse| {
            let at = |round: usize| impulse.at_s + round as f64 * emulator.impulse_period_s;
            (0..rounds).map(at).take_while(|at_s| *at_s < to_s).map(|at_s| (at_s, *impulse))
        });
        let mut impulses: Vec<(f64, Impulse)> = each.collect();
        impulses.sort_by(|a, b| a.0.total_cmp(&b.0));
        if impulses.is_empty() {
            // One that comes too late is still the one that was meant.
            let first = emulator.impulse.iter().min_by(|a, b| a.at_s.total_cmp(&b.at_s));
            impulses.extend(first.map(|first| (first.at_s, *first)));
        }
        impulses
    }

    /// [s] the last moment before the largest angle at which the body had not moved.
    fn onset(&self) -> f64 {
        let largest = (0..self.moments.len())
            .max_by(|a, b| self.moments[*a].angle.abs().total_cmp(&self.moments[*b].angle.abs()))
            .unwrap_or(0);
        let peak = self.moments.get(largest).map_or(0.0, |moment| moment.angle.abs());
        let before = self.moments.get(..largest).unwrap_or_default();
        before
            .iter()
            .rev()
            .find(|moment| moment.angle.abs() < THRESHOLDS.unmoved_share * peak)
            .map_or(0.0, |moment| moment.time)
    }

    fn know_the_disturbance(&mut self) {
        if self.struck_from == StruckFrom::Angle {
            return;
        }
        let torque = |(at_s, it): &(f64, Impulse)| (*at_s..*at_s + it.duration_s, it.torque);
        let torques: Vec<_> = self.impulses.iter().map(torque).collect();
        for moment in &mut self.moments {
            let acting = torques.iter().filter(|(struck, _)| struck.contains(&moment.time));
            moment.disturbance = acting.map(|(_, torque)| torque).sum();
        }
    }

    /// `windows` [s]: how long each strike is judged.
    fn judged(self, windows: &[f64]) -> RecordedRun {
        let emulator = self.config.as_ref().filter(|_| self.is_virtual).map(|config| &config.emulator);
        let name = self.name();
        let struck_s = self.strikes.first().copied().unwrap_or(f64::NAN);
        let window_s = windows.first().copied().unwrap_or(THRESHOLDS.answer_window_s);
        let by = |struck_s: f64| self.impulses.iter().find(|it| it.0 == struck_s).map(|it| it.1);
        let later = self
            .strikes
            .iter()
            .zip(windows)
            .skip(1)
            .filter(|(_, window_s)| **window_s >= THRESHOLDS.shortest_answer_s);
        let later = later.filter_map(|(&struck_s, &window_s)| {
            let answer = measure(&self.moments, struck_s, window_s);
            Some(LaterStrike { struck_s, impulse: by(struck_s)?, window_s, answer })
        });
        RecordedRun {
            recording: name,
            controller: self.controller.clone(),
            delay: emulator.map(|emulator| emulator.command_delay_s),
            struck_s,
            struck_from: self.struck_from,
            impulse: by(struck_s),
            window_s,
            is_angle_measured: self.is_angle_measured,
            answer: measure(&self.moments, struck_s, window_s),
            later: later.collect(),
            recorded_otherwise: self.recorded_otherwise,
            moments: self.moments,
        }
    }
}

fn moment(step: &ControlStep, begun_ns: u64, is_angle_measured: bool) -> Moment {
    let estimate = &step.command.estimate;
    let angle = if is_angle_measured { step.sensors.body_angle.value } else { estimate.body_angle };
    Moment {
        time: clock::span_s(step.command.stamp_ns.saturating_sub(begun_ns)),
        angle: angle - estimate.reference_angle,
        torque: step.command.torque,
        estimate: estimate.disturbance_torque,
        disturbance: f64::NAN,
    }
}

/// Where runs differ in more than the controller, or is not known of them.
fn findings(runs: &[RecordedRun]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for run in runs {
        let name = &run.recording;
        if !run.is_angle_measured {
            findings.push(Finding::new("angle_not_measured", columns::BODY_ANGLE).of(name));
        }
        findings.extend(run.recorded_otherwise.clone());
        if run.struck_from == StruckFrom::Angle {
            findings.push(Finding::new("impulse_unknown", "impulse").of(name).with("struck_s", run.struck_s));
        }
    }
    let push = |impulse: &Impulse| impulse.duration_s * impulse.torque;
    if let Some(first) = runs.first().and_then(|run| run.impulse.as_ref()) {
        for run in runs.iter().skip(1) {
            let Some(other) = &run.impulse else { continue };
            // As floating-point numbers from the same text they are equal to the last bit.
            if push(other) != push(first) || other.torque != first.torque {
                findings.push(
                    Finding::new("impulses_differ", "impulse")
                        .with("recording", runs[0].recording.as_str())
                        .with("torque_nm", first.torque)
                        .with("duration_s", first.duration_s)
                        .with("other_recording", run.recording.as_str())
                        .with("other_torque_nm", other.torque)
                        .with("other_duration_s", other.duration_s),
                );
            }
        }
    }
    findings
}
