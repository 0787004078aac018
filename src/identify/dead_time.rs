//! The lag behind a transport delay, everything fitted at once: what the model gets where the data settle the delay.
//!
//! A lag fitted to a late rotor makes up for the delay with a pole that is too slow. Where the delay is the rival that
//! the data ask for, and with it nothing but noise is left, delay and pole go into the model together; where more is
//! missing, `diagnose` has to find out what, and the delay is only told of.

use nalgebra::DVector;
use serde::Serialize;

use super::Estimate;
use super::lag_order::{Rival, golden};
use super::pole::{self, LagFit, Record};
use super::regressors::{NO_DELAY, UNHEARD};
use crate::effect::Term;
use crate::estimation::least_squares;

/// Folds of the cross-validation.
pub(crate) const FOLDS: usize = 3;
/// Lag-one correlation of the residual up to which what is left counts as noise.
pub(crate) const CORRELATED: f64 = 0.5;
/// Standard errors around the rival's delay, and sampling intervals, among which the whole record's is looked for.
const AROUND: (f64, f64) = (6.0, 0.1);
/// Step of the derivatives by the delay, in sampling intervals: between two samples the cost is a parabola.
const STEP: f64 = 0.1;

/// A transport delay taken into the model, and what it did.
#[derive(Debug, Clone, Serialize)]
pub struct Delay {
    /// [s]
    pub delay: Estimate,
    /// [rad/s] the pole that a lag without the delay gets from the same data.
    pub pole_without: Estimate,
    /// [rad/s] rms of the residual without the delay.
    pub residual_without: f64,
    /// [rad/s] rms of the residual with it.
    pub residual_with: f64,
    /// [rad/s] rms on held-out blocks, without the delay and with it.
    pub held_out: [f64; 2],
}

/// The fit with the delay: its covariance allows for the delay's own error.
#[derive(Debug, Clone)]
pub(crate) struct LateFit {
    pub fit: LagFit,
    pub told: Delay,
}

/// The fit with the delay that `rivals` hold, where that is the one the data ask for and leaves noise alone;
/// `record(τ)` is the record with commands delayed by τ.
pub(crate) fn identify<const M: usize>(
    lag: &LagFit,
    rivals: &[Rival],
    interval: f64,
    record: impl Fn(f64) -> Record<M>,
) -> Option<LateFit> {
    let near = rivals.iter().find(|rival| rival.term == Term::DeadTime && rival.needed && rival.clear)?;
    let at = |delay: f64| pole::fit_from(&record(delay), near.pole);
    let cost =
        |delay: f64| at(delay).map_or(f64::INFINITY, |fit| fit.residual_rms.powi(2) * fit.samples as f64);
    let around = (AROUND.0 * near.time.standard_error).max(AROUND.1 * interval);
    let longest = (near.time.value + around).min(UNHEARD * interval);
    let (delay, least) = golden(cost, (near.time.value - around).max(NO_DELAY), longest);
    let mut fit = at(delay)?;
    if fit.residual_correlation > CORRELATED {
        return None;
    }
    let step = (STEP * interval).min(0.5 * delay);
    let (before, behind) = (at(delay - step)?, at(delay + step)?);
    let squares = |fit: &LagFit| fit.residual_rms.powi(2) * fit.samples as f64;
    let curvature = (0.5 * (squares(&before) + squares(&behind)) - least) / (step * step);
    let correlation = fit.residual_correlation.clamp(0.0, CORRELATED);
    let stretch = (1.0 + correlation) / (1.0 - correlation);
    let variance = stretch * least / fit.samples as f64 / curvature.max(f64::MIN_POSITIVE);
    // What the delay's error does to the rest: along the valley of the cost they follow it.
    let values = |fit: &LagFit| fit.coefficients.iter().copied().chain([fit.pole]).collect::<Vec<f64>>();
    let slope = (DVector::from(values(&behind)) - DVector::from(values(&before))) / (2.0 * step);
    fit.covariance += &slope * slope.transpose() * variance;
    let rms = |squares: Vec<f64>| (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
    let told = Delay {
        delay: Estimate { value: delay, standard_error: variance.sqrt() },
        pole_without: Estimate { value: lag.pole, standard_error: lag.pole_error() },
        residual_without: lag.residual_rms,
        residual_with: fit.residual_rms,
        held_out: [rms(held_out(&record(NO_DELAY), lag.pole)?), rms(held_out(&record(delay), fit.pole)?)],
    };
    Some(LateFit { fit, told })
}

/// [rad²/s²] mean squared error of each block of the record when it was held out of the fit; `near` [rad/s] is a pole
/// to start from.
pub(crate) fn held_out<const M: usize>(record: &Record<M>, near: f64) -> Option<Vec<f64>> {
    let blocks: Vec<std::ops::Range<usize>> = least_squares::blocks(record.time.len()).collect();
    let mut squares = vec![0.0; blocks.len()];
    for fold in 0..FOLDS {
        let held = || blocks.iter().enumerate().filter(move |(index, _)| index % FOLDS == fold);
        let mut kept = record.clone();
        held().for_each(|(_, rows)| kept.output[rows.clone()].fill(f64::NAN));
        let errors = pole::errors(record, &pole::fit_from(&kept, near)?);
        for (index, rows) in held() {
            let scored: Vec<f64> = errors[rows.clone()].iter().copied().filter(|e| e.is_finite()).collect();
            squares[index] = scored.iter().map(|e| e * e).sum::<f64>() / scored.len().max(1) as f64;
        }
    }
    Some(squares)
}
