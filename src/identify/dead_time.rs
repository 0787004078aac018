//! The lag behind a transport delay, by joint estimation: what the model gets where the data show the delay.
//!
//! A lag fitted to a rotor with a dead time makes up for the delay with a pole that is too slow. Where the delay is the alternative that
//! the data ask for, and with it nothing but noise is left, delay and pole go into the model together; where more is
//! missing, `diagnose` has to find out what, and the delay is only reported.

use super::thresholds::THRESHOLDS;
use nalgebra::DVector;
use serde::Serialize;

use super::Estimate;
use super::lag_order::LagAlternative;
use super::regressors::NO_DELAY;
use crate::effect::Term;
use crate::estimation::autocorrelation::variance_inflation;
use crate::estimation::golden_section::golden;
use crate::estimation::moments::{mean, mean_square};
use crate::estimation::robust_errors;
use crate::estimation::variable_projection::{self, LagFit, Record};

/// A transport delay taken into the model, and what it did.
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
pub(crate) struct DelayedFit {
    pub fit: LagFit,
    pub delay: Delay,
}

/// The fit with the delay that `alternatives` hold, where that is the one the data ask for and leaves noise alone;
/// `record(τ)` is the record with commands delayed by τ, and τ is `unknown` [s] in any case.
pub(crate) fn identify<const M: usize>(
    lag: &LagFit,
    alternatives: &[LagAlternative],
    (interval, unknown): (f64, f64),
    record: impl Fn(f64) -> Record<M>,
) -> Option<DelayedFit> {
    let near = alternatives.iter().find(|it| it.term == Term::DeadTime && it.needed && it.clear)?;
    let at = |delay: f64| variable_projection::fit_from(&record(delay), near.pole);
    let cost =
        |delay: f64| at(delay).map_or(f64::INFINITY, |fit| fit.residual_rms.powi(2) * fit.samples as f64);
    let around = (THRESHOLDS.delay_search_errors * near.time.standard_error)
        .max(THRESHOLDS.delay_search_intervals * interval);
    let longest = (near.time.value + around).min(THRESHOLDS.unheard_intervals * interval);
    let (delay, least) = golden(cost, (near.time.value - around).max(NO_DELAY), longest);
    let mut fit = at(delay)?;
    if fit.residual_correlation > THRESHOLDS.correlated_residual {
        return None;
    }
    let step = (THRESHOLDS.delay_step * interval).min(THRESHOLDS.delay_step_share * delay);
    let (before, behind) = (at(delay - step)?, at(delay + step)?);
    let squares = |fit: &LagFit| fit.residual_rms.powi(2) * fit.samples as f64;
    let curvature = (0.5 * (squares(&before) + squares(&behind)) - least) / (step * step);
    let correlation = fit.residual_correlation.clamp(0.0, THRESHOLDS.correlated_residual);
    let stretch = variance_inflation(correlation);
    let variance = stretch * least / fit.samples as f64 / curvature.max(f64::MIN_POSITIVE);
    // What the delay's error does to the rest: along the valley of the cost they follow it.
    let values = |fit: &LagFit| fit.coefficients.iter().copied().chain([fit.pole]).collect::<Vec<f64>>();
    let slope = (DVector::from(values(&behind)) - DVector::from(values(&before))) / (2.0 * step);
    fit.covariance += &slope * slope.transpose() * variance;
    let rms = |squares: Vec<f64>| mean(&squares).sqrt();
    let delay_found = Delay {
        delay: Estimate { value: delay, standard_error: variance.sqrt().hypot(unknown) },
        pole_without: Estimate { value: lag.pole, standard_error: lag.pole_error() },
        residual_without: lag.residual_rms,
        residual_with: fit.residual_rms,
        held_out: [rms(held_out(&record(NO_DELAY), lag.pole)?), rms(held_out(&record(delay), fit.pole)?)],
    };
    Some(DelayedFit { fit, delay: delay_found })
}

/// [rad²/s²] mean squared error of each block of the record when it was held out of the fit; `near` [rad/s] is a pole
/// to start from.
pub(crate) fn held_out<const M: usize>(record: &Record<M>, near: f64) -> Option<Vec<f64>> {
    let blocks: Vec<std::ops::Range<usize>> = robust_errors::blocks(record.time.len()).collect();
    let mut squares = vec![0.0; blocks.len()];
    for fold in 0..THRESHOLDS.delay_folds {
        let held =
            || blocks.iter().enumerate().filter(move |(index, _)| index % THRESHOLDS.delay_folds == fold);
        let mut kept = record.clone();
        held().for_each(|(_, rows)| kept.output[rows.clone()].fill(f64::NAN));
        let errors = variable_projection::errors(record, &variable_projection::fit_from(&kept, near)?);
        for (index, rows) in held() {
            let scored: Vec<f64> = errors[rows.clone()].iter().copied().filter(|e| e.is_finite()).collect();
            squares[index] = mean_square(&scored);
        }
    }
    Some(squares)
}
