//! Flights out of recordings, judged side by side: the same disturbance through several controllers.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::answer::{Answer, Moment, judge};
use super::lockstep::ORIGIN_NS;
use crate::bench::BenchConfig;
use crate::clock;
use crate::emulate::Impulse;
use crate::record::{Record, RecordError, Recording};
use crate::signal::ControlStep;

/// Share of the largest angle below which a flight has not been struck yet.
const UNMOVED: f64 = 0.05;
/// [s] shortest stretch behind the impulse that says anything.
const SHORTEST_S: f64 = 0.5;

/// Why flights cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum FlightError {
    /// The recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// It holds no flight.
    #[error("{}: no step of a controller with the guard open; a flight is what `run` or `control` recorded", path.display())]
    NoFlight {
        /// The file.
        path: PathBuf,
    },
    /// It ends too early.
    #[error("{}: struck at {struck_s:.2} s, but the flight lasts from {from_s:.2} to {to_s:.2} s only", path.display())]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StruckFrom {
    /// Said by who compares.
    Told,
    /// The emulator's settings in the recording, which was made in virtual time.
    Recording,
    /// The moment from which the angle moves to its largest value.
    Angle,
}

/// One recorded flight, judged.
#[derive(Debug, Serialize)]
pub struct RecordedFlight {
    /// File name.
    pub recording: String,
    /// `EMC` or `PID`.
    pub controller: &'static str,
    /// [s] transport delay of the emulated bench; absent where the recording does not say it.
    pub delay: Option<f64>,
    /// [s] when the body was struck, since the flight's clock began.
    pub struck_s: f64,
    /// How that is known.
    pub struck_from: StruckFrom,
    /// The impulse, where it is known.
    pub impulse: Option<Impulse>,
    /// [s] how long it was judged.
    pub judged_s: f64,
    /// Whether the angle was measured at the pivot; else it is the controller's own estimate.
    pub is_angle_measured: bool,
    /// How the controller answered.
    pub answer: Answer,
    /// Period by period.
    #[serde(skip)]
    pub moments: Vec<Moment>,
}

/// Several flights, and what the reader must know of them.
#[derive(Debug, Serialize)]
pub struct FlightComparison {
    /// In the order given.
    pub flights: Vec<RecordedFlight>,
    /// Where they are not alike.
    pub warnings: Vec<String>,
}

/// Reads and judges the flights in `recordings`, all over the same time behind the impulse. `told` is the impulse, `at_s`
/// counted from the first record of a controller's step, where the recordings do not say it.
///
/// # Errors
/// [`FlightError`] naming the file.
pub fn compare_flights(
    recordings: &[PathBuf],
    told: Option<Impulse>,
) -> Result<FlightComparison, FlightError> {
    let mut raw = recordings.iter().map(|path| RawFlight::read(path, told)).collect::<Result<Vec<_>, _>>()?;
    let judged_s = raw.iter().map(RawFlight::behind_s).fold(f64::INFINITY, f64::min);
    let flights: Vec<RecordedFlight> = raw.drain(..).map(|flight| flight.judged(judged_s)).collect();
    let warnings = warnings(&flights);
    Ok(FlightComparison { flights, warnings })
}

/// A flight before it is judged.
struct RawFlight {
    path: PathBuf,
    config: Option<BenchConfig>,
    is_virtual: bool,
    is_angle_measured: bool,
    controller: &'static str,
    moments: Vec<Moment>,
    struck_s: f64,
    struck_from: StruckFrom,
    impulse: Option<Impulse>,
    /// [s] when the next impulse strikes.
    until_s: f64,
}

impl RawFlight {
    fn read(path: &Path, told: Option<Impulse>) -> Result<Self, FlightError> {
        let mut recording = Recording::open(path)?;
        let mut steps = Vec::new();
        for record in recording.by_ref() {
            if let Record::ControlStep(step) = record? {
                steps.push(step);
            }
        }
        // A recording of another version is still a flight.
        let config: Option<BenchConfig> = toml::from_str(&recording.provenance().bench).ok();
        // Nobody's monotonic clock is that young when a bench starts.
        let is_virtual = steps.first().is_some_and(|step| step.command.stamp_ns < 2 * ORIGIN_NS);
        let begun_ns = if is_virtual { ORIGIN_NS } else { steps.first().map_or(0, |it| it.command.stamp_ns) };
        steps.retain(|step| step.applied.command_sequence > 0 && matches!(step.command.controller, 1 | 2));
        let Some(last) = steps.last() else { return Err(FlightError::NoFlight { path: path.to_owned() }) };
        let controller = if last.command.controller == 1 { "EMC" } else { "PID" };
        let is_angle_measured = steps.iter().all(|step| step.sensors.body_angle.is_good());
        let moments = steps.iter().map(|step| moment(step, begun_ns, is_angle_measured)).collect();
        let mut flight = Self {
            path: path.to_owned(),
            config,
            is_virtual,
            is_angle_measured,
            controller,
            moments,
            struck_s: 0.0,
            struck_from: StruckFrom::Told,
            impulse: told,
            until_s: f64::INFINITY,
        };
        flight.find_the_impulse();
        let (from_s, to_s) = flight.span();
        if flight.struck_s < from_s || flight.behind_s() < SHORTEST_S {
            let (path, struck_s) = (flight.path, flight.struck_s);
            return Err(FlightError::NothingBehind { path, struck_s, from_s, to_s });
        }
        flight.know_the_disturbance();
        Ok(flight)
    }

    fn span(&self) -> (f64, f64) {
        let time = |moment: Option<&Moment>| moment.map_or(0.0, |moment| moment.time);
        (time(self.moments.first()), time(self.moments.last()))
    }

    /// [s] that can be judged.
    fn behind_s(&self) -> f64 {
        self.span().1.min(self.until_s) - self.struck_s
    }

    fn find_the_impulse(&mut self) {
        let recorded = self.config.as_ref().filter(|_| self.is_virtual).map(|config| &config.emulator);
        if let Some(impulse) = self.impulse {
            self.struck_s = impulse.at_s;
        } else if let Some(first) = recorded
            .and_then(|emulator| emulator.impulse.iter().min_by(|a, b| a.at_s.total_cmp(&b.at_s)).copied())
        {
            (self.impulse, self.struck_s, self.struck_from) =
                (Some(first), first.at_s, StruckFrom::Recording);
        } else {
            (self.struck_s, self.struck_from) = (self.onset(), StruckFrom::Angle);
        }
        if let Some(emulator) = recorded {
            let again = if emulator.impulse_period_s > 0.0 {
                self.struck_s + emulator.impulse_period_s
            } else {
                f64::INFINITY
            };
            let next = emulator.impulse.iter().map(|it| it.at_s).filter(|at_s| *at_s > self.struck_s);
            self.until_s = next.fold(again, f64::min);
        }
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
            .find(|moment| moment.angle.abs() < UNMOVED * peak)
            .map_or(0.0, |moment| moment.time)
    }

    fn know_the_disturbance(&mut self) {
        let Some(impulse) = self.impulse else { return };
        let struck = impulse.at_s..impulse.at_s + impulse.duration_s;
        for moment in &mut self.moments {
            moment.disturbance = if struck.contains(&moment.time) { impulse.torque } else { 0.0 };
        }
    }

    fn judged(self, judged_s: f64) -> RecordedFlight {
        let emulator = self.config.as_ref().filter(|_| self.is_virtual).map(|config| &config.emulator);
        let name = self.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        RecordedFlight {
            recording: name,
            controller: self.controller,
            delay: emulator.map(|emulator| emulator.command_delay_s),
            struck_s: self.struck_s,
            struck_from: self.struck_from,
            impulse: self.impulse,
            judged_s,
            is_angle_measured: self.is_angle_measured,
            answer: judge(&self.moments, self.struck_s, judged_s),
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

/// What makes flights unlike each other.
fn warnings(flights: &[RecordedFlight]) -> Vec<String> {
    let mut warnings = Vec::new();
    for flight in flights {
        let name = &flight.recording;
        if !flight.is_angle_measured {
            warnings.push(format!(
                "{name}: the angle was not measured; the controller's own estimate is judged, which drifts with the gyro's bias"
            ));
        }
        if flight.struck_from == StruckFrom::Angle {
            warnings.push(format!(
                "{name}: it does not say when the body was struck; taken from the angle, {:.2} s after the first step. \
                 --impulse AT:DURATION:TORQUE says it, and then the error of the disturbance's estimate is known, too",
                flight.struck_s
            ));
        }
    }
    let push = |impulse: &Impulse| impulse.duration_s * impulse.torque;
    if let Some(first) = flights.first().and_then(|flight| flight.impulse.as_ref()) {
        for flight in flights.iter().skip(1) {
            let Some(other) = &flight.impulse else { continue };
            // As floating-point numbers from the same text they are equal to the last bit.
            if push(other) != push(first) || other.torque != first.torque {
                warnings.push(format!(
                    "not the same disturbance: {} was struck by {} N m for {} s, {} by {} N m for {} s",
                    flights[0].recording,
                    first.torque,
                    first.duration_s,
                    flight.recording,
                    other.torque,
                    other.duration_s
                ));
            }
        }
    }
    warnings
}
