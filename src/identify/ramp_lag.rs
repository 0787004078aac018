//! g(u) behind the lag of the rotor, from ramps.
//!
//! On a ramp that has lasted the rotor is behind g(u) by g'(u) u̇ / p; for a few 1/p behind each turn and each beginning
//! it is not, and a curve fitted as if it were is off by standard errors. So the powers of the command go through the
//! lag, [LPC16] Eq. (2), second line, and p is found with the coefficients where the ramps go up and down. Ramps
//! one way do not separate the lag from the curve: there it is what exciting commands showed, if any.

use super::Estimate;
use super::regressors::record_of;
use super::steady_rows::{HIGHEST_DEGREE, SteadyRows, goes_both_ways};
use super::thresholds::THRESHOLDS;
use crate::effect::step_response;
use crate::estimation::variable_projection::{self, LagFit, Record};
use crate::model::polynomial;
use crate::screening::rotor_data::RotorLog;

/// How the rotor follows its command, from other logs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KnownLag {
    /// [rad/s]
    pub pole: Estimate,
    /// [s]
    pub delay: f64,
}

/// The lag that ramps are fitted behind.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RampLag {
    /// [rad/s] where the search starts, or the pole itself.
    pole: f64,
    /// [rad/s] standard error of a pole that is known; `None` where the ramps show it.
    known: Option<f64>,
    /// [s]
    delay: f64,
}

/// The lag to be fitted behind: `seen` [s] is that between ramps up and ramps down, half a sample of the hold in it.
pub(crate) fn choose(rows: &SteadyRows, seen: Option<Estimate>, known: Option<KnownLag>) -> Option<RampLag> {
    if !rows.from_ramps {
        return None;
    }
    let delay = known.map_or(0.0, |known| known.delay);
    let interval = rows.ramps.first()?.interval;
    // A lag within a sample is none that bends anything.
    let shows = |lag: &Estimate| {
        lag.value > THRESHOLDS.ramp_lag_errors * lag.standard_error && lag.value > delay + interval
    };
    let shown = seen.filter(|lag| shows(lag) && goes_both_ways(rows));
    let shown =
        shown.map(|lag| RampLag { pole: 1.0 / (lag.value - delay - 0.5 * interval), known: None, delay });
    let given = known.map(|KnownLag { pole, delay }| RampLag {
        pole: pole.value,
        known: Some(pole.standard_error),
        delay,
    });
    shown.or(given)
}

/// The coefficients of g(u), and the rms of the residual [rad/s]. `gain_error` [rad/(s V)] is the standard error of
/// k_V: by what the curve moves with it, and with a pole that is known, its errors grow.
pub(crate) fn identify(
    rows: &SteadyRows,
    degree: usize,
    lag: &RampLag,
    gain_error: f64,
) -> Option<(Vec<Estimate>, f64)> {
    let ramps = &corrected(rows, rows.gain, lag.pole);
    let fit = fit(ramps, degree, lag)?;
    let moved = |ramps: &[RotorLog], lag: &RampLag| -> Option<Vec<f64>> {
        let other = self::fit(ramps, degree, lag)?;
        Some(other.coefficients.iter().zip(&fit.coefficients).map(|(other, fit)| other - fit).collect())
    };
    let unmoved = || Some(vec![0.0; degree]);
    let by_gain = if gain_error > 0.0 {
        moved(&corrected(rows, rows.gain + gain_error, lag.pole), &RampLag { pole: fit.pole, ..*lag })
    } else {
        unmoved()
    }?;
    let by_pole = match lag.known {
        Some(error) => moved(ramps, &RampLag { pole: lag.pole + error, ..*lag }),
        None => unmoved(),
    }?;
    let estimate = |index: usize| Estimate {
        value: fit.coefficients[index],
        standard_error: fit.error(index).hypot(by_gain[index]).hypot(by_pole[index]),
    };
    Some(((0..degree).map(estimate).collect(), fit.residual_rms))
}

/// Commands [-] of the ramps and the rates [rad/s] as they would be without the lag.
pub(crate) fn without_lag(rows: &SteadyRows, lag: &RampLag) -> Option<(Vec<f64>, Vec<f64>)> {
    let ramps = &corrected(rows, rows.gain, lag.pole);
    let degree = (1..=HIGHEST_DEGREE).rev().find(|degree| fit(ramps, *degree, lag).is_some())?;
    match degree {
        1 => without_lag_of::<1>(ramps, lag),
        2 => without_lag_of::<2>(ramps, lag),
        3 => without_lag_of::<3>(ramps, lag),
        _ => without_lag_of::<4>(ramps, lag),
    }
}

fn without_lag_of<const M: usize>(ramps: &[RotorLog], lag: &RampLag) -> Option<(Vec<f64>, Vec<f64>)> {
    let record = record::<M>(ramps, lag.delay);
    let fit = fit_to(&record, lag)?;
    let errors = variable_projection::errors(&record, &fit);
    let each = record.inputs.iter().zip(errors).filter(|(_, error)| error.is_finite());
    let curve = |u: f64| u * polynomial(&fit.coefficients, u);
    Some(each.map(|(inputs, error)| (inputs[0], curve(inputs[0]) + error)).unzip())
}

fn fit(ramps: &[RotorLog], degree: usize, lag: &RampLag) -> Option<LagFit> {
    match degree {
        1 => fit_to(&record::<1>(ramps, lag.delay), lag),
        2 => fit_to(&record::<2>(ramps, lag.delay), lag),
        3 => fit_to(&record::<3>(ramps, lag.delay), lag),
        _ => fit_to(&record::<4>(ramps, lag.delay), lag),
    }
}

fn fit_to<const M: usize>(record: &Record<M>, lag: &RampLag) -> Option<LagFit> {
    if lag.known.is_some() {
        return variable_projection::fit_at(record, lag.pole);
    }
    let near = |fit: &LagFit| {
        (1.0 / THRESHOLDS.ramp_pole_factor..THRESHOLDS.ramp_pole_factor).contains(&(fit.pole / lag.pole))
    };
    variable_projection::fit_from(record, lag.pole).filter(near)
}

/// Powers u, u², ... of the command, and y_g for what they give.
fn record<const M: usize>(ramps: &[RotorLog], delay: f64) -> Record<M> {
    record_of(ramps, 0.0, delay, |u, _| std::array::from_fn(|power| u.powi(power as i32 + 1)))
}

/// The ramps with y_g for rate, what the battery takes at a k_V of `gain` [rad/(s V)] taken as the rotor follows it, with
/// that `pole` [rad/s].
fn corrected(rows: &SteadyRows, gain: f64, pole: f64) -> Vec<RotorLog> {
    let mut ramps = rows.ramps.clone();
    for ramp in &mut ramps {
        let Some(voltage) = &ramp.voltage else { continue };
        for stretch in &ramp.stretches {
            let mut acting = voltage[stretch.start];
            for row in stretch.clone() {
                ramp.rate[row] += gain * (rows.full_voltage - acting);
                if row + 1 < stretch.end {
                    // A battery does not jump: over an interval it counts with both ends.
                    let between = 0.5 * (voltage[row] + voltage[row + 1]);
                    acting += (between - acting) * step_response(pole, ramp.time[row + 1] - ramp.time[row]);
                }
            }
        }
    }
    ramps
}
