//! The torque that the model lacks, over time: the disturbance state of the embedded model, [LPC16] Eqs. (20)
//! to (23), estimated forwards by a Kalman filter and backwards by a Rauch-Tung-Striebel smoother.
//!
//! States: angle, rate, unknown torque, its slope. The torque wanders; how fast is chosen so that the log
//! becomes most likely, so a model that lacks nothing gets a torque that stays at zero.

use nalgebra::{Matrix4, RowVector4, Vector4};
use serde::Serialize;

use super::CompareError;
use super::blocks::{body_inputs, true_rate};
use super::channels::{BODY_ANGLE, BODY_RATE};
use super::dependence::{Dependence, dependences};
use super::noise::{Noise, rotor_noise};
use super::thresholds::THRESHOLDS;
use crate::effect::Site;
use crate::log::Dataset;
use crate::model::{BodyInput, BodyStart, BodyTrace, Equations, Model, ModelError};

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
    /// Row of the log of each sample.
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
}

/// One stretch, ready for the filter.
struct FilterInput {
    rows: std::ops::Range<usize>,
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
    log: &Dataset,
    noise: &Noise,
) -> Result<Option<UnknownTorque>, CompareError> {
    let equations = model.equations()?;
    let (Some(rate), Some(driven)) = (log.column(BODY_RATE), body_inputs(&equations, log)) else {
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
    };
    let mut known = Vec::new();
    for part in &parts {
        for (torque, error) in backwards(&filter(part, &spread, wander, usize::MAX).0) {
            found.torque.push(torque);
            found.standard_error.push(error);
        }
        found.rows.extend(part.rows.clone());
        found.time.extend(&part.time);
        let steps = part.time.windows(2).zip(&part.gained);
        known.extend(steps.map(|(pair, gained)| spread.inertia * gained / (pair[1] - pair[0])));
    }
    found.rms = rms(&found.torque);
    found.mean = found.torque.iter().sum::<f64>() / found.torque.len().max(1) as f64;
    found.uncertainty = rms(&found.standard_error);
    found.known_rms = rms(&known);
    found.dependences = dependences(log, &found.rows, &found.torque);
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
    let tried = (0..THRESHOLDS.wanders_tried).map(|number| {
        let wander = THRESHOLDS.slowest_wander * 2.0_f64.powi(number as i32);
        (wander, filter(part, spread, wander, THRESHOLDS.wander_samples).1)
    });
    tried.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(THRESHOLDS.slowest_wander, |(wander, _)| wander)
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
    rows: std::ops::Range<usize>,
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

/// Forwards over at most `most` samples: every state, and the logarithm of the likelihood.
fn filter(part: &FilterInput, spread: &FilterNoise, wander: f64, most: usize) -> (Vec<FilterState>, f64) {
    let first = |values: &[f64]| values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    let mut state = Vector4::new(first(&part.angle), first(&part.rate), 0.0, 0.0);
    // A torque of 1 N m, and a slope of 1 N m/s, would be much.
    let mut covariance = Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 1.0, 1.0));
    let mut passed = Vec::new();
    let mut likelihood = 0.0;
    for row in 0..part.time.len().min(most) {
        let before = (state, covariance);
        let rate = (part.rate[row], spread.gyro, RowVector4::new(0.0, 1.0, 0.0, 0.0));
        let angle = (part.angle[row], spread.angle, RowVector4::new(1.0, 0.0, 0.0, 0.0));
        for (value, size, pick) in [rate, angle] {
            if !value.is_finite() {
                continue;
            }
            let innovation = value - (pick * state)[0];
            let variance = (pick * covariance * pick.transpose())[0] + size * size;
            let gain = covariance * pick.transpose() / variance;
            state += gain * innovation;
            covariance -= gain * pick * covariance;
            covariance = 0.5 * (covariance + covariance.transpose());
            likelihood -= 0.5 * (innovation * innovation / variance + variance.ln());
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
        passed.push(FilterState { before, after: (state, covariance), transition });
        let gained = part.gained[row];
        state = transition * state + Vector4::new(0.5 * step * gained, gained, 0.0, 0.0);
        let kick = spread.rotors * step;
        let noise = Vector4::new(
            0.0,
            kick * kick,
            wander * wander * step,
            (THRESHOLDS.slope_rate * wander).powi(2) * step,
        );
        covariance = transition * covariance * transition.transpose() + Matrix4::from_diagonal(&noise);
    }
    (passed, likelihood)
}

/// Backwards: the unknown torque and its standard error at each sample, [N m].
fn backwards(passed: &[FilterState]) -> Vec<(f64, f64)> {
    let mut found = vec![(f64::NAN, f64::NAN); passed.len()];
    let Some(last) = passed.last() else { return found };
    let (mut state, mut covariance) = last.after;
    for row in (0..passed.len()).rev() {
        if let Some(next) = passed.get(row + 1) {
            let here = &passed[row];
            // P F' (P⁻)⁻¹, by the Cholesky factor of P⁻, which is positive definite by its added noise.
            let Some(factor) = next.before.1.cholesky() else { break };
            let gain = factor.solve(&(here.transition * here.after.1)).transpose();
            state = here.after.0 + gain * (state - next.before.0);
            covariance = here.after.1 + gain * (covariance - next.before.1) * gain.transpose();
        }
        found[row] = (state[2], covariance[(2, 2)].max(0.0).sqrt());
    }
    found
}
