//! The error of a block, scored against the noise.

use serde::Serialize;

use super::block_run::{BlockRun, NoisePath, thinned};
use super::dependence::at_rows;
use super::noise::{Noise, rotor_noise};
use super::regimes::Failure;
use super::related_rows::Related;
use super::run::RunMode;
use super::thresholds::THRESHOLDS;
use super::trace::Trace;
use super::{CompareConfig, gyro_block};
use crate::log::Dataset;
use crate::model::Model;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// How large the error of a block is, and of what it consists.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorStatistics {
    /// Rms, in the signal's unit.
    pub rms: f64,
    /// [%] 100 (1 - |y - m| / |y - mean y|), as MATLAB's `compare` prints it; not-a-number, as the shares, where the
    /// signal never moves, or by less than noise alone.
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

impl ErrorStatistics {
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

/// A block that was run and scored.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct ScoredBlock {
    /// `actuator_1`, `actuator_2`, ..., `thrust_1`, ..., `body`, `sensors`, `chain`.
    pub name: String,
    /// Column it answers.
    pub signal: String,
    /// Unit of the signal.
    pub unit: &'static str,
    /// Columns that drive it.
    pub driven_by: Vec<String>,
    /// How it was run.
    #[serde(skip)]
    pub run: RunMode,
    /// Samples scored.
    pub samples: usize,
    /// How large the error is.
    pub error: ErrorStatistics,
    /// Where it fails.
    pub failure: Failure,
    /// The signals themselves.
    #[serde(skip)]
    pub trace: Trace,
}

impl BlockRun {
    /// Scores an error against the noise; what it has to do with the channels is another question, asked of the samples that come
    /// with the scores.
    pub(crate) fn score(
        self,
        model: &Model,
        log: &Dataset,
        noise: &Noise,
        config: &CompareConfig,
    ) -> (ScoredBlock, Related) {
        let residual = &self.residual(log)[..];
        let related = Related::of(&self.rows, residual.into());
        let error = self.error(residual, log, self.noise_floor(model, log, noise, config));
        let corner =
            if self.name.starts_with("actuator") { model.actuator.pole / std::f64::consts::TAU } else { 1.0 };
        let time = at_rows(log.time(), &self.rows);
        let interval = log.median_interval();
        let failure = Failure::of(&time, &self.modelled, residual, &self.pieces, interval, corner);
        drop(time);
        let scored = ScoredBlock {
            name: self.name.clone(),
            signal: self.signal.clone(),
            unit: self.unit,
            driven_by: self.driven_by.clone(),
            run: self.run,
            samples: residual.iter().filter(|value| value.is_finite()).count(),
            error,
            failure,
            trace: if config.signals { self.into_trace(log) } else { Trace::default() },
        };
        (scored, related)
    }

    fn error(&self, residual: &[f64], log: &Dataset, noise_floor: f64) -> ErrorStatistics {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (error, value) in residual.iter().zip(self.scored(log)).filter(|(error, _)| error.is_finite()) {
            count += 1.0;
            sum += value;
            squares += error * error;
        }
        let mean = sum / count;
        let scored = residual.iter().zip(self.scored(log)).filter(|(error, _)| error.is_finite());
        let spread: f64 = scored.map(|(_, value)| (value - mean).powi(2)).sum();
        // A signal that never moves has no variance to share out; rounding of the mean is no movement.
        let is_still = spread <= count * (1e-12 * mean).powi(2);
        let floor = noise_floor * noise_floor * count / spread;
        // One that moves by much less than noise does is one that never moves: a body that is held.
        let of_motion =
            |share: f64| if is_still || floor > THRESHOLDS.still_noise { f64::NAN } else { share };
        let noise = floor.min(squares / spread);
        let scatter = THRESHOLDS.floor_scatter.powi(2) + 0.5 / self.independent(count);
        ErrorStatistics {
            rms: (squares / count).sqrt(),
            fit_percent: of_motion(100.0 * (1.0 - (squares / spread).sqrt())),
            noise_floor,
            explained: of_motion((1.0 - squares / spread).max(0.0)),
            noise: of_motion(noise),
            unexplained: of_motion((squares / spread).min(1.0) - noise.min(1.0)),
            one_step: self.one_step,
            limit: THRESHOLDS.floor_error + if is_still { 0.0 } else { 2.0 * scatter.sqrt() },
        }
    }

    /// Errors that know nothing of each other: every sample of a free run, one a window.
    fn independent(&self, count: f64) -> f64 {
        match self.floor {
            NoisePath::Sensor | NoisePath::Thrust(_) => count,
            NoisePath::Window { .. } => self.pieces.len() as f64,
            NoisePath::Slope(half) => count / half as f64,
        }
    }

    fn noise_floor(&self, model: &Model, log: &Dataset, noise: &Noise, config: &CompareConfig) -> f64 {
        let sensor = noise.of(&self.signal);
        let gyro = noise.of(BODY_RATE);
        let (horizon, interval) = (config.horizon_s, log.median_interval());
        match self.floor {
            NoisePath::Sensor => sensor,
            NoisePath::Thrust(slope) => {
                let rate = self.driven_by.first().map_or(0.0, |rate| noise.of(rate));
                sensor.hypot(slope * rate)
            }
            // Means over the window of the variance at each instant: of the start's rate, once for the rate and
            // times t² for the angle; of the rotors' noise, which walks with t and, integrated, with t³/3.
            NoisePath::Window { rotors, angle, behind } => {
                let kick = if rotors { rotor_noise(model, noise) } else { 0.0 };
                let walk = kick * kick * interval * horizon;
                // Of what lags the rate now counts as the rate at the start does.
                let (start, end) = (behind.start * gyro, behind.rotors_s * kick);
                let variance = if angle {
                    let start = start.hypot(end) * horizon;
                    2.0 * sensor * sensor + start * start / 3.0 + walk * horizon * horizon / 12.0
                } else {
                    sensor * sensor + start * start + 2.0 * end * end + walk / 2.0
                };
                variance.sqrt()
            }
            NoisePath::Slope(half) => {
                let [gyro, angle] = [(BODY_RATE, gyro), (BODY_ANGLE, noise.of(BODY_ANGLE))]
                    .map(|(name, noise)| noise * thinned(log, name));
                gyro_block::noise(half, interval, gyro, angle)
            }
        }
    }
}
