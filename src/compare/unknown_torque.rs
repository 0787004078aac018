//! The torque that the model lacks, over time: the disturbance state of the embedded model, [LPC16] Eqs. (20)
//! to (23), estimated forwards by a Kalman filter and backwards by a Rauch-Tung-Striebel smoother.
//!
//! States: angle, rate, unknown torque, its slope. The torque wanders; how fast is chosen so that the log
//! becomes most likely, so a model that lacks nothing gets a torque that stays at zero.

use std::ops::Range;

use nalgebra::{Matrix4, RowVector4, Vector4};
use serde::Serialize;

use super::blocks::{body_inputs, true_rate};
use super::channels::{BODY_ANGLE, BODY_RATE};
use super::dependence::{Dependence, at_rows};
use super::noise::{Noise, rotor_noise};
use super::thresholds::THRESHOLDS;
use super::{CompareConfig, CompareError};
use crate::cancel;
use crate::effect::Site;
use crate::log::Dataset;
use crate::model::{BodyInput, BodyStart, BodyTrace, Equations, Model, ModelError};
use crate::screening::ScreenedLog;
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
    /// Row of the log of each sample; empty, as all that follows, where [`CompareConfig::signals`] says so.
    #[serde(skip)]
    pub rows: Vec<usize>,
    /// [s]
    #[serde(skip)]
    pub time: Vec<f64>,
    /// [N m]
    #[serde(skip)]
    pub torque: Vec<f64>,
    /// [N m]
    #[serde(skip)]
    pub standard_error: Vec<f64>,
    /// Rows of the log, stretch by stretch.
    #[serde(skip)]
    pub(crate) parts: Vec<Range<usize>>,
}

impl UnknownTorque {
    /// Lays the signals out, or forgets them.
    pub(crate) fn keep(&mut self, log: &Dataset, config: &CompareConfig) {
        if config.signals {
            self.rows = self.parts.iter().flat_map(Clone::clone).collect();
            self.time = at_rows(log.time(), &self.parts).into_owned();
        } else {
            (self.torque, self.standard_error) = (Vec::new(), Vec::new());
        }
    }
}

/// One stretch, ready for the filter.
struct FilterInput {
    rows: Range<usize>,
    time: Vec<f64>,
    /// [rad/s] what the model adds to the rate until the next sample.
    gained: Vec<f64>,
    /// [rad/s], [rad] measurements; not-a-number = missing.
    rate: Vec<f64>,
    angle: Vec<f64>,
}

/// Noise the filter reckons with.
#[derive(Clone, Copy)]
struct FilterNoise {
    inertia: f64,
    /// [rad/s] gyroscope, [rad] angle.
    gyro: f64,
    angle: f64,
    /// [rad/s²] of the rotors' rates, on the acceleration.
    rotors: f64,
}

/// Filter state at a sample: before and after its measurements.
struct FilterState {
    before: (Vector4<f64>, Matrix4<f64>),
    after: (Vector4<f64>, Matrix4<f64>),
    /// From the sample to the next.
    transition: Matrix4<f64>,
}

/// Estimates the torque; `None` where the log has no body rate, or nothing that drives the body.
pub(crate) fn smooth(
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
    let parts: Vec<FilterInput> = driven
        .stretches
        .iter()
        .map(|(rows, input)| {
            let angle = angle.map(|angle| &angle[rows.clone()]);
            filter_input((&equations, &body), rows.clone(), input, &rate[rows.clone()], angle)
        })
        .collect();
    let spread = FilterNoise {
        inertia: model.body.inertia,
        // A sensor without visible noise still has a last digit.
        gyro: noise.of(BODY_RATE).max(1e-6),
        angle: noise.of(BODY_ANGLE).max(1e-7),
        rotors: rotor_noise(model, noise),
    };
    let Some(longest) = parts.iter().max_by_key(|part| part.time.len()) else { return Ok(None) };
    let wander = likeliest_wander(longest, &spread);
    let mut found = UnknownTorque {
        rms: 0.0,
        mean: 0.0,
        uncertainty: 0.0,
        known_rms: 0.0,
        dependences: Vec::new(),
        rows: Vec::new(),
        time: Vec::new(),
        torque: Vec::new(),
        standard_error: Vec::new(),
        parts: parts.iter().map(|part| part.rows.clone()).collect(),
    };
    let mut known = Vec::new();
    for part in &parts {
        for (torque, error) in smoothed(part, &spread, wander) {
            found.torque.push(torque);
            found.standard_error.push(error);
        }
        let steps = part.time.windows(2).zip(&part.gained);
        known.extend(steps.map(|(pair, gained)| spread.inertia * gained / (pair[1] - pair[0])));
    }
    found.rms = rms(&found.torque);
    found.mean = found.torque.iter().sum::<f64>() / found.torque.len().max(1) as f64;
    found.uncertainty = rms(&found.standard_error);
    found.known_rms = rms(&known);
    Ok((!found.torque.is_empty()).then_some(found))
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

/// [N m/√s] the wander under which a stretch is likeliest.
fn likeliest_wander(part: &FilterInput, spread: &FilterNoise) -> f64 {
    let wanders: Vec<f64> = (0..THRESHOLDS.wanders_tried)
        .map(|number| THRESHOLDS.slowest_wander * 2.0_f64.powi(number as i32))
        .collect();
    let tried = threads::spread(&wanders, |wander| {
        let mut filter = Filter::of(part, spread, *wander);
        for row in 0..part.time.len().min(THRESHOLDS.wander_samples) {
            let _ = filter.step(row);
        }
        (*wander, filter.likelihood)
    });
    tried
        .into_iter()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(THRESHOLDS.slowest_wander, |(wander, _)| wander)
}

/// Rms of the values that are there.
fn rms(values: &[f64]) -> f64 {
    let good = values.iter().filter(|value| value.is_finite());
    let (sum, count) = good.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    f64::sqrt(sum / count)
}

/// What the model says about each step, taken from the measured state; `body` is the model with a gyroscope
/// that shows the true rate.
fn filter_input(
    (equations, body): (&Equations, &Equations),
    rows: Range<usize>,
    input: &BodyInput,
    rate: &[f64],
    angle: Option<&[f64]>,
) -> FilterInput {
    let (mut newest_rate, mut newest_angle) = (0.0, 0.0);
    let mut trace = BodyTrace::default();
    let (mut gained, mut true_rates) = (Vec::new(), Vec::new());
    for row in 0..input.time.len() {
        if let Some(angle) = angle.map(|angle| angle[row]).filter(|angle| angle.is_finite()) {
            newest_angle = angle;
        }
        let turned = true_rate(equations, input, row, newest_angle, rate[row]);
        if turned.is_finite() {
            newest_rate = turned;
        }
        true_rates.push(turned);
        trace.rate.clear();
        trace.angle.clear();
        let start = BodyStart { angle: newest_angle, rate: newest_rate, sensor: 0.0 };
        body.simulate_body(input, row, row + 2, &start, &mut trace);
        gained.push(trace.rate.get(1).map_or(0.0, |after| after - newest_rate));
    }
    let angle = angle.map_or_else(|| vec![f64::NAN; rate.len()], <[f64]>::to_vec);
    FilterInput { rows, time: input.time.clone(), gained, rate: true_rates, angle }
}

/// The filter on its way through a stretch.
struct Filter<'a> {
    part: &'a FilterInput,
    spread: &'a FilterNoise,
    /// [N m/√s]
    wander: f64,
    /// State and covariance before the next sample's measurements.
    state: Vector4<f64>,
    covariance: Matrix4<f64>,
    /// Logarithm of the likelihood of all samples so far.
    likelihood: f64,
}

impl<'a> Filter<'a> {
    fn of(part: &'a FilterInput, spread: &'a FilterNoise, wander: f64) -> Self {
        let first = |values: &[f64]| values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
        let state = Vector4::new(first(&part.angle), first(&part.rate), 0.0, 0.0);
        // A torque of 1 N m, and a slope of 1 N m/s, would be much.
        let covariance = Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 1.0, 1.0));
        Self { part, spread, wander, state, covariance, likelihood: 0.0 }
    }

    /// Takes in what was measured at a sample, and goes on to the next.
    fn step(&mut self, row: usize) -> FilterState {
        let Self { part, spread, wander, state, covariance, likelihood } = self;
        let before = (*state, *covariance);
        let rate = (part.rate[row], spread.gyro, RowVector4::new(0.0, 1.0, 0.0, 0.0));
        let angle = (part.angle[row], spread.angle, RowVector4::new(1.0, 0.0, 0.0, 0.0));
        for (value, size, pick) in [rate, angle] {
            if !value.is_finite() {
                continue;
            }
            let innovation = value - (pick * *state)[0];
            let variance = (pick * *covariance * pick.transpose())[0] + size * size;
            let gain = *covariance * pick.transpose() / variance;
            *state += gain * innovation;
            *covariance -= gain * pick * *covariance;
            *covariance = 0.5 * (*covariance + covariance.transpose());
            *likelihood -= 0.5 * (innovation * innovation / variance + variance.ln());
        }
        let step = part.time.get(row + 1).map_or(0.0, |next| next - part.time[row]);
        let turn = step / spread.inertia;
        #[rustfmt::skip]
        let transition = Matrix4::new(
            1.0, step, 0.5 * step * turn, 0.0,
            0.0, 1.0,  turn,              0.5 * step * turn,
            0.0, 0.0,  1.0,               step,
            0.0, 0.0,  0.0,               1.0,
        );
        let passed = FilterState { before, after: (*state, *covariance), transition };
        let gained = part.gained[row];
        *state = transition * *state + Vector4::new(0.5 * step * gained, gained, 0.0, 0.0);
        let kick = spread.rotors * step;
        let noise = Vector4::new(
            0.0,
            kick * kick,
            *wander * *wander * step,
            (THRESHOLDS.slope_rate * *wander).powi(2) * step,
        );
        *covariance = transition * *covariance * transition.transpose() + Matrix4::from_diagonal(&noise);
        passed
    }
}

/// Samples over which the filter's states are kept at a time, on the way back.
const KEPT: usize = 1_024;

/// Forwards and backwards: the unknown torque and its standard error at each sample, [N m]. All states of a long stretch take
/// many times the log's memory: some are kept, and what follows each of them is computed again.
fn smoothed(part: &FilterInput, spread: &FilterNoise, wander: f64) -> Vec<(f64, f64)> {
    let length = part.time.len();
    let mut filter = Filter::of(part, spread, wander);
    let mut starts = Vec::new();
    for row in 0..length {
        if row.is_multiple_of(KEPT) {
            cancel::check();
            starts.push((row, filter.state, filter.covariance));
        }
        filter.step(row);
    }
    let mut found = vec![(f64::NAN, f64::NAN); length];
    let mut behind: Option<Smoothed> = None;
    for (start, state, covariance) in starts.into_iter().rev() {
        cancel::check();
        (filter.state, filter.covariance) = (state, covariance);
        let passed: Vec<FilterState> =
            (start..(start + KEPT).min(length)).map(|row| filter.step(row)).collect();
        for (row, here) in passed.iter().enumerate().rev() {
            let smoothed = match &behind {
                None => Some(here.after),
                Some(behind) => behind.carried_to(here),
            };
            let Some((state, covariance)) = smoothed else { return found };
            found[start + row] = (state[2], covariance[(2, 2)].max(0.0).sqrt());
            behind = Some(Smoothed { state, covariance, predicted: here.before });
        }
    }
    found
}

/// What is known of a sample from all samples.
struct Smoothed {
    state: Vector4<f64>,
    covariance: Matrix4<f64>,
    /// What was, from those before it alone.
    predicted: (Vector4<f64>, Matrix4<f64>),
}

impl Smoothed {
    /// State and covariance of the sample before.
    fn carried_to(&self, here: &FilterState) -> Option<(Vector4<f64>, Matrix4<f64>)> {
        // P F' (P⁻)⁻¹, by the Cholesky factor of P⁻, which is positive definite by its added noise.
        let factor = self.predicted.1.cholesky()?;
        let gain = factor.solve(&(here.transition * here.after.1)).transpose();
        let state = here.after.0 + gain * (self.state - self.predicted.0);
        let covariance = here.after.1 + gain * (self.covariance - self.predicted.1) * gain.transpose();
        Some((state, covariance))
    }
}
