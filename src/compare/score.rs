//! The error of a block, judged against the noise.

use std::ops::Range;

use serde::Serialize;

use super::blocks::{BODY_ANGLE, BODY_RATE, RATES};
use super::dependence::{correlations, dependences};
use super::noise::Noise;
use super::regimes::Failure;
use super::unknown_torque::UnknownTorque;
use super::{CompareConfig, gyro_block};
use crate::log::Dataset;
use crate::model::Model;

/// How large the error of a block is, and of what it consists.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Error {
    /// Rms, in the signal's unit.
    pub rms: f64,
    /// [%] 100 (1 - |y - m| / |y - mean y|), as MATLAB's `compare` prints it; not-a-number, as the shares, where the
    /// signal never moves.
    pub fit_percent: f64,
    /// Rms that the noise of the sensors alone would leave, in the signal's unit.
    pub noise_floor: f64,
    /// [-] share of the signal's variance that the model explains.
    pub explained: f64,
    /// [-] share that is noise.
    pub noise: f64,
    /// [-] share that is neither.
    pub unexplained: f64,
    /// Rms one sample ahead, in the signal's unit: a diagnostic, not a score.
    pub one_step: Option<f64>,
    /// [-] error over noise floor up to which nothing can be said to be left: the floor's own uncertainty and
    /// the error's, two standard errors.
    pub limit: f64,
}

impl Error {
    /// [-] error over noise floor.
    #[must_use]
    pub fn over_floor(&self) -> f64 {
        match self.noise_floor > 0.0 {
            true => self.rms / self.noise_floor,
            // A channel that never moved and that the model meets exactly.
            false if self.rms == 0.0 => 1.0,
            false => f64::INFINITY,
        }
    }

    /// Whether the error is the sensors' noise.
    #[must_use]
    pub fn is_noise(&self) -> bool {
        self.over_floor() < self.limit
    }
}

/// [-] what a floor may be off by its assumptions: white noise, straight lines between samples.
const FLOOR_ERROR: f64 = 1.05;
/// [-] scatter of a noise estimate.
const FLOOR_SCATTER: f64 = 0.02;

/// Measured and modelled signal, sample by sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Row of the log of each sample.
    pub rows: Vec<usize>,
    /// [s]
    pub time: Vec<f64>,
    /// In the signal's unit; not-a-number = not measured.
    pub measured: Vec<f64>,
    /// In the signal's unit.
    pub modelled: Vec<f64>,
}

/// A block that was run and judged.
#[derive(Debug, Clone, Serialize)]
pub struct Block {
    /// `actuator_1`, `actuator_2`, `thrust_1`, `thrust_2`, `body`, `sensors`, `chain`.
    pub name: String,
    /// Column it answers.
    pub signal: String,
    /// Unit of the signal.
    pub unit: &'static str,
    /// Columns that drive it.
    pub driven_by: Vec<String>,
    /// How it was run, in words.
    pub run: String,
    /// Samples judged.
    pub samples: usize,
    /// How large the error is.
    pub error: Error,
    /// Where it fails.
    pub failure: Failure,
    /// The signals themselves.
    #[serde(skip)]
    pub trace: Trace,
}

/// A block that was run, before it is judged.
pub(crate) struct Raw {
    pub name: &'static str,
    pub signal: String,
    pub unit: &'static str,
    pub driven_by: Vec<String>,
    pub run: String,
    /// Whether what a perfect model leaves changes from sample to sample by the sensor's noise alone, or by hardly more: the
    /// noisy start of a window moves all of it smoothly.
    pub shows_noise: bool,
    pub rows: Vec<usize>,
    pub measured: Vec<f64>,
    pub modelled: Vec<f64>,
    /// Parts without a hole.
    pub pieces: Vec<Range<usize>>,
    pub one_step: Option<f64>,
    floor: Floor,
}

/// How the sensors' noise reaches the error of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Floor {
    /// Through the sensor of the signal alone.
    Sensor,
    /// Through thrust sensor and rotor rate, whose slope [N s/rad] is given.
    Thrust(f64),
    /// Through the start of each window and, where they drive the body, the rotors' rates.
    Window { rotors: bool, angle: bool },
    /// Through a slope over so many samples to both sides.
    Slope(usize),
}

impl Raw {
    /// An empty run of a block.
    pub(crate) fn new(
        name: &'static str,
        signal: &str,
        unit: &'static str,
        driven_by: &[&str],
        floor: Floor,
    ) -> Self {
        Self {
            name,
            signal: signal.to_owned(),
            unit,
            driven_by: driven_by.iter().map(|name| (*name).to_owned()).collect(),
            run: match floor {
                Floor::Sensor => "free run",
                Floor::Thrust(_) => "at each sample",
                _ => "smoothed alike",
            }
            .to_owned(),
            shows_noise: matches!(floor, Floor::Sensor | Floor::Window { .. }),
            rows: Vec::new(),
            measured: Vec::new(),
            modelled: Vec::new(),
            pieces: Vec::new(),
            one_step: None,
            floor,
        }
    }

    /// Adds a part without a hole: rows of the log, and both signals there.
    pub(crate) fn add(&mut self, rows: Range<usize>, measured: &[f64], modelled: &[f64]) {
        let from = self.rows.len();
        self.rows.extend(rows);
        self.measured.extend_from_slice(measured);
        self.modelled.extend_from_slice(modelled);
        self.pieces.push(from..self.rows.len());
    }

    /// Whether each piece is a window, started at a measurement.
    pub(crate) fn is_in_windows(&self) -> bool {
        matches!(self.floor, Floor::Window { .. })
    }

    fn residual(&self) -> Vec<f64> {
        self.measured.iter().zip(&self.modelled).map(|(y, m)| y - m).collect()
    }

    /// Judges the error against the noise.
    pub(crate) fn judge(
        self,
        model: &Model,
        log: &Dataset,
        noise: &Noise,
        config: &CompareConfig,
        unknown_torque: Option<&UnknownTorque>,
    ) -> Block {
        let residual = self.residual();
        let error = self.error(&residual, self.noise_floor(model, log, noise, config));
        let corner =
            if self.name.starts_with("actuator") { model.actuator.pole / std::f64::consts::TAU } else { 1.0 };
        let time: Vec<f64> = self.rows.iter().map(|row| log.time()[*row]).collect();
        let interval = log.median_interval();
        let mut failure = Failure::of(&time, &self.modelled, &residual, &self.pieces, interval, corner);
        match (self.name, unknown_torque) {
            // What the body lacks is a torque; its dependences are clearer than those of an integrated error.
            ("body", Some(torque)) => {
                failure.dependences = torque.dependences.clone();
                failure.correlations = correlations(log, &torque.rows, &torque.torque, interval);
            }
            _ => {
                failure.dependences = dependences(log, &self.rows, &residual);
                failure.correlations = correlations(log, &self.rows, &residual, interval);
            }
        }
        Block {
            name: self.name.to_owned(),
            signal: self.signal,
            unit: self.unit,
            driven_by: self.driven_by,
            run: self.run,
            samples: residual.iter().filter(|value| value.is_finite()).count(),
            error,
            failure,
            trace: Trace { rows: self.rows, time, measured: self.measured, modelled: self.modelled },
        }
    }

    fn error(&self, residual: &[f64], noise_floor: f64) -> Error {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (error, value) in residual.iter().zip(&self.measured).filter(|(error, _)| error.is_finite()) {
            count += 1.0;
            sum += value;
            squares += error * error;
        }
        let mean = sum / count;
        let judged = residual.iter().zip(&self.measured).filter(|(error, _)| error.is_finite());
        let spread: f64 = judged.map(|(_, value)| (value - mean).powi(2)).sum();
        // Rounding of the mean is no movement.
        if spread <= count * (1e-12 * mean).powi(2) {
            // A signal that never moves has no variance to share out.
            let rms = (squares / count).sqrt();
            let (one_step, limit) = (self.one_step, FLOOR_ERROR);
            let none = f64::NAN;
            return Error {
                rms,
                fit_percent: none,
                noise_floor,
                explained: none,
                noise: none,
                unexplained: none,
                one_step,
                limit,
            };
        }
        let noise = (noise_floor * noise_floor * count / spread).min(squares / spread);
        Error {
            rms: (squares / count).sqrt(),
            fit_percent: 100.0 * (1.0 - (squares / spread).sqrt()),
            noise_floor,
            explained: (1.0 - squares / spread).max(0.0),
            noise,
            unexplained: (squares / spread).min(1.0) - noise.min(1.0),
            one_step: self.one_step,
            limit: FLOOR_ERROR + 2.0 * (FLOOR_SCATTER * FLOOR_SCATTER + 0.5 / self.independent(count)).sqrt(),
        }
    }

    /// Errors that know nothing of each other: every sample of a free run, one a window.
    fn independent(&self, count: f64) -> f64 {
        match self.floor {
            Floor::Sensor | Floor::Thrust(_) => count,
            Floor::Window { .. } => self.pieces.len() as f64,
            Floor::Slope(half) => count / half as f64,
        }
    }

    fn noise_floor(&self, model: &Model, log: &Dataset, noise: &Noise, config: &CompareConfig) -> f64 {
        let sensor = noise.of(&self.signal);
        let gyro = noise.of(BODY_RATE);
        let (horizon, interval) = (config.horizon_s, log.median_interval());
        match self.floor {
            Floor::Sensor => sensor,
            Floor::Thrust(slope) => {
                let rate = if self.name == "thrust_1" { RATES[0] } else { RATES[1] };
                sensor.hypot(slope * noise.of(rate))
            }
            // Means over the window of the variance at each instant: of the start's rate, once for the rate and
            // times t² for the angle; of the rotors' noise, which walks with t and, integrated, with t³/3.
            Floor::Window { rotors, angle } => {
                let kick = if rotors { rotor_noise(model, noise) } else { 0.0 };
                let walk = kick * kick * interval * horizon;
                let variance = if angle {
                    2.0 * sensor * sensor + (gyro * horizon).powi(2) / 3.0 + walk * horizon * horizon / 12.0
                } else {
                    2.0 * sensor * sensor + walk / 2.0
                };
                variance.sqrt()
            }
            Floor::Slope(half) => {
                let [gyro, angle] = [(BODY_RATE, gyro), (BODY_ANGLE, noise.of(BODY_ANGLE))]
                    .map(|(name, noise)| noise * gyro_block::thinned(log, name));
                gyro_block::noise(half, interval, gyro, angle)
            }
        }
    }
}

/// [rad/s²] noise that the measured rates of both rotors put on the body's acceleration.
pub(crate) fn rotor_noise(model: &Model, noise: &Noise) -> f64 {
    let actuator = &model.actuator;
    let slope = 2.0 * model.body.arm * actuator.thrust_coefficient * actuator.hover_rate / model.body.inertia;
    slope * noise.of(RATES[0]).hypot(noise.of(RATES[1]))
}
