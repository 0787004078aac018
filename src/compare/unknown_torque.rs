//! The torque that the model lacks, over time: the disturbance state of the embedded model, [LPC16] Eqs. (20)
//! to (23), from all samples ([`kalman_smoother`](crate::estimation::kalman_smoother)).
//!
//! States: angle, rate, unknown torque, its slope. The torque is a random walk; how fast is chosen so that the log
//! becomes most likely, so a model that lacks nothing gets a torque that stays at zero.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::{Matrix4, RowVector4, Vector4};
use serde::Serialize;

use super::block_run::BehindSensors;
use super::body_drive::body_inputs;
use super::dependence::Dependence;
use super::noise::{Noise, rotor_noise};
use super::thresholds::THRESHOLDS;
use super::trace::SampleRows;
use super::{CompareConfig, CompareError};
use crate::effect::Site;
use crate::estimation::kalman_smoother::{Belief, LinearSystem, Measurement, Transition, likelihood, smooth};
use crate::estimation::moments::rms_of_finite;
use crate::estimation::slope::finite_slope;
use crate::log::Cells;
use crate::model::{BodyInput, Equations, LagInverse, Model, ModelError};
use crate::screening::{ScreenedLog, readings};
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};
use crate::threads;

/// The smoothed unknown torque.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnknownTorque {
    /// [N m] rms over the log.
    pub rms: f64,
    /// [N m] mean over the log.
    pub mean: f64,
    /// [N m] rms of its standard error: a torque of this size is nothing.
    pub uncertainty: f64,
    /// [N m] rms of the torque that the model knows: rotors and effects.
    pub known_rms: f64,
    /// What it depends on, the strongest first.
    pub dependences: Vec<Dependence>,
    /// Rows of the log that have a sample; none, as all that follows, where [`CompareConfig::signals`] says so.
    #[serde(skip)]
    pub rows: SampleRows,
    /// [N m]
    #[serde(skip)]
    pub torque: Cells,
    /// [N m]
    #[serde(skip)]
    pub standard_error: Cells,
    /// Rows of the log, stretch by stretch.
    #[serde(skip)]
    pub(crate) parts: Vec<Range<usize>>,
}

impl UnknownTorque {
    /// Keeps the signals, or forgets them.
    pub(crate) fn keep(&mut self, config: &CompareConfig) {
        if config.signals {
            self.rows = SampleRows::of(self.parts.clone());
        } else {
            (self.torque, self.standard_error) = (Cells::default(), Cells::default());
        }
    }
}

/// One stretch, ready for the estimate.
struct TorqueInput<'a> {
    rows: Range<usize>,
    time: &'a [f64],
    /// [rad/s] what the model adds to the rate until the next sample.
    gained: Vec<f64>,
    /// [rad/s], [rad] measurements; not-a-number = missing.
    rate: Cow<'a, [f64]>,
    /// Empty where the log has none.
    angle: &'a [f64],
}

/// Noise that the estimate reckons with.
#[derive(Clone, Copy)]
struct TorqueNoise {
    inertia: f64,
    /// [rad/s] gyroscope, [rad] angle.
    gyro: f64,
    angle: f64,
    /// [rad/s²] of the rotors' rates, on the acceleration.
    rotors: f64,
}

/// Estimates the torque; `None` where the log has no body rate, or nothing that drives the body.
pub(crate) fn estimate(
    model: &Model,
    screened: &ScreenedLog,
    noise: &Noise,
) -> Result<Option<UnknownTorque>, CompareError> {
    let equations = model.equations()?;
    let log = screened.dataset();
    let (Some(rate), Some(driven)) = (log.column(BODY_RATE), body_inputs(&equations, screened)) else {
        return Ok(None);
    };
    let body = without_gyroscope(model)?.equations()?;
    let angle = log.column(BODY_ANGLE);
    let readings = readings::bridged(log.time(), rate);
    let interval = log.median_interval();
    let gyroscope = equations.gyroscope_inverse(interval);
    let behind = BehindSensors::of((&gyroscope, &LagInverse::NONE), log);
    let parts: Vec<TorqueInput> = driven
        .stretches
        .iter()
        .map(|(rows, input)| {
            let angle = angle.map(|angle| &angle[rows.clone()]);
            let rate = (&rate[rows.clone()], &readings[rows.clone()]);
            torque_input((&equations, &body), &gyroscope, rows.clone(), input, rate, angle)
        })
        .collect();
    let spread = TorqueNoise {
        inertia: model.body.inertia,
        gyro: behind.start * noise.of(BODY_RATE).max(THRESHOLDS.least_gyro_noise),
        angle: noise.of(BODY_ANGLE).max(THRESHOLDS.least_angle_noise),
        rotors: rotor_noise(model, noise),
    };
    let Some(longest) = parts.iter().max_by_key(|part| part.time.len()) else { return Ok(None) };
    let walk = likeliest_walk(longest, &spread);
    Ok(smoothed_over(&parts, &spread, walk))
}

/// The torque over parts of a log; `None` where they have no sample.
fn smoothed_over(parts: &[TorqueInput], spread: &TorqueNoise, walk: f64) -> Option<UnknownTorque> {
    let samples = parts.iter().map(|part| part.time.len()).sum();
    let (mut torques, mut errors) = (vec![f64::NAN; samples], vec![f64::NAN; samples]);
    let mut first = 0;
    for part in parts {
        smooth(&RandomWalkTorque { part, spread, walk }, TORQUE, |sample, torque, error| {
            (torques[first + sample], errors[first + sample]) = (torque, error);
        });
        first += part.time.len();
    }
    let known = parts.iter().flat_map(|part| {
        let steps = part.time.windows(2).zip(&part.gained);
        steps.map(|(pair, gained)| spread.inertia * gained / (pair[1] - pair[0]))
    });
    let found = UnknownTorque {
        rms: rms_of_finite(torques.iter().copied()),
        mean: torques.iter().sum::<f64>() / torques.len().max(1) as f64,
        uncertainty: rms_of_finite(errors.iter().copied()),
        known_rms: rms_of_finite(known),
        dependences: Vec::new(),
        rows: SampleRows::default(),
        torque: torques.into(),
        standard_error: errors.into(),
        parts: parts.iter().map(|part| part.rows.clone()).collect(),
    };
    (!found.torque.is_empty()).then_some(found)
}

/// The model without the laws of its gyroscope: the step of the body itself shows.
fn without_gyroscope(model: &Model) -> Result<Model, ModelError> {
    let mut body = model.clone();
    body.effects.clear();
    for added in &model.effects {
        if model.effect(&added.id)?.site != Site::BodyRateSensor {
            body.effects.push(added.clone());
        }
    }
    Ok(body)
}

/// [N m/√s] the walk under which a stretch is likeliest.
fn likeliest_walk(part: &TorqueInput<'_>, spread: &TorqueNoise) -> f64 {
    let walks: Vec<f64> = (0..THRESHOLDS.walks_tried)
        .map(|number| THRESHOLDS.slowest_walk * 2.0_f64.powi(number as i32))
        .collect();
    let tried = threads::spread(&walks, |walk| {
        let system = RandomWalkTorque { part, spread, walk: *walk };
        (*walk, likelihood(&system, THRESHOLDS.walk_samples).known())
    });
    tried.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(THRESHOLDS.slowest_walk, |(walk, _)| walk)
}

/// What the model says about each step, taken from the measured state; `body` is the model with a gyroscope
/// that shows the true rate. The rate is as it was measured, and without gaps.
fn torque_input<'a>(
    (equations, body): (&Equations, &Equations),
    gyroscope: &LagInverse,
    rows: Range<usize>,
    input: &'a BodyInput,
    (rate, readings): (&'a [f64], &[f64]),
    angle: Option<&'a [f64]>,
) -> TorqueInput<'a> {
    let (mut newest_rate, mut newest_angle) = (0.0, 0.0);
    let has_laws = equations.has_rate_sensor_laws();
    let mut gained = Vec::with_capacity(input.time.len());
    let mut true_rates = Vec::with_capacity(if has_laws { input.time.len() } else { 0 });
    for row in 0..input.time.len() {
        if let Some(angle) = angle.map(|angle| angle[row]).filter(|angle| angle.is_finite()) {
            newest_angle = angle;
        }
        let shown = (input.time[row], newest_angle, rate[row]);
        let start =
            equations.start_behind(gyroscope, shown, |half| finite_slope(&input.time, readings, row, half));
        let turned = start.rate;
        if turned.is_finite() {
            newest_rate = turned;
        }
        if has_laws {
            true_rates.push(turned);
        }
        let after = body.next_body_rate(input, row, newest_angle, newest_rate);
        gained.push(after.map_or(0.0, |after| after - newest_rate));
    }
    let rate = if has_laws { Cow::Owned(true_rates) } else { Cow::Borrowed(rate) };
    TorqueInput { rows, time: &input.time, gained, rate, angle: angle.unwrap_or_default() }
}

/// Angle, rate, unknown torque and its slope over a stretch, when the torque walks at random by `walk` [N m/√s].
struct RandomWalkTorque<'a> {
    part: &'a TorqueInput<'a>,
    spread: &'a TorqueNoise,
    walk: f64,
}

/// Which of the states is the torque [N m].
const TORQUE: usize = 2;

impl LinearSystem<4, 2> for RandomWalkTorque<'_> {
    fn samples(&self) -> usize {
        self.part.time.len()
    }

    fn start(&self) -> Belief<4> {
        let first = |values: &[f64]| values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
        let state = Vector4::new(first(self.part.angle), first(&self.part.rate), 0.0, 0.0);
        // A torque of 1 N m, and a slope of 1 N m/s, would be much.
        let covariance = Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 1.0, 1.0));
        Belief { state, covariance }
    }

    #[inline]
    fn readings(&self, row: usize) -> [Measurement<4>; 2] {
        let Self { part, spread, .. } = self;
        let (rate, angle) = (RowVector4::new(0.0, 1.0, 0.0, 0.0), RowVector4::new(1.0, 0.0, 0.0, 0.0));
        [
            Measurement { value: part.rate[row], noise: spread.gyro, of: rate },
            Measurement {
                value: part.angle.get(row).copied().unwrap_or(f64::NAN),
                noise: spread.angle,
                of: angle,
            },
        ]
    }

    #[inline]
    fn step(&self, row: usize) -> Transition<4> {
        let Self { part, spread, walk } = self;
        let step = part.time.get(row + 1).map_or(0.0, |next| next - part.time[row]);
        let turn = step / spread.inertia;
        #[rustfmt::skip]
        let transition = Matrix4::new(
            1.0, step, 0.5 * step * turn, 0.0,
            0.0, 1.0,  turn,              0.5 * step * turn,
            0.0, 0.0,  1.0,               step,
            0.0, 0.0,  0.0,               1.0,
        );
        let gained = part.gained[row];
        let kick = spread.rotors * step;
        Transition {
            transition,
            input: Vector4::new(0.5 * step * gained, gained, 0.0, 0.0),
            variance: Vector4::new(
                0.0,
                kick * kick,
                *walk * *walk * step,
                (THRESHOLDS.slope_rate * *walk).powi(2) * step,
            ),
        }
    }
}
