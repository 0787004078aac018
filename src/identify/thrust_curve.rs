//! The thrust curve where thrust was measured: f = c ω² through the origin, and the tangent at hover,
//! [LPC16] Eq. (13), f ≈ c_p1 ω + c_p0.

use super::thresholds::THRESHOLDS;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Estimate;
use crate::estimation::least_squares;
use crate::screening::{Finding, ScreenedLog};

/// The fitted thrust curve.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct ThrustCurve {
    /// [N s²/rad²] c.
    pub coefficient: Estimate,
    /// [rad/s] hover rate ω_0 at which the tangent is taken.
    pub hover_rate: f64,
    /// [N s/rad] c_p1 = 2 c ω_0.
    pub slope: Estimate,
    /// [N] c_p0 = -c ω_0².
    pub offset: Estimate,
    /// [N] rms of the residual.
    pub residual_rms: f64,
    /// Samples used.
    pub samples: usize,
    /// [-] linear part at hover, as a share of the thrust, if one is allowed beside the quadratic.
    pub linear_share: Estimate,
}

/// [rad/s] [N] rate and thrust of the scored rows of one rotor of a log whose commands and rates it holds.
fn pairs(log: &ScreenedLog, number: usize) -> Vec<(f64, f64)> {
    let Some(judged) = log.rotor(number).and(log.thrust(number)) else { return Vec::new() };
    let (rate, thrust) = (judged.rate(log.dataset()), judged.scored(log.dataset()));
    rate.iter().copied().zip(thrust.iter().copied()).filter(|(_, thrust)| thrust.is_finite()).collect()
}

/// Fits the thrust curve over the rotors of these numbers; `None` where no thrust was measured.
pub(crate) fn identify(
    logs: &[ScreenedLog],
    rotors: &[usize],
    hover_rate: f64,
    warnings: &mut Vec<Finding>,
) -> Option<ThrustCurve> {
    let of_log = |log| rotors.iter().flat_map(move |number| pairs(log, *number));
    let rows: Vec<(f64, f64)> = logs.iter().flat_map(of_log).collect();
    if rows.len() < THRESHOLDS.fewest_thrust_rows {
        return None;
    }
    let y = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.1));
    let square = DMatrix::from_fn(rows.len(), 1, |row, _| rows[row].0.powi(2));
    let fit = least_squares::least_squares(&square, &y)?;
    let coefficient = Estimate { value: fit.coefficients[0], standard_error: fit.standard_error(0) };
    let both = DMatrix::from_fn(rows.len(), 2, |row, column| {
        let ratio = rows[row].0 / hover_rate;
        if column == 0 { ratio } else { ratio * ratio }
    });
    let linear_share = least_squares::least_squares(&both, &y).map_or(Estimate::unknown(), |fit| {
        let thrust = fit.coefficients[0] + fit.coefficients[1];
        Estimate { value: fit.coefficients[0] / thrust, standard_error: fit.standard_error(0) / thrust.abs() }
    });
    if linear_share.value.abs() > THRESHOLDS.linear_thrust_share
        && linear_share.value.abs() > THRESHOLDS.linear_thrust_errors * linear_share.standard_error
    {
        let linear = Finding::new("thrust_not_quadratic", "thrust_coefficient");
        warnings.push(linear.with("linear_share", linear_share.value));
    }
    if coefficient.value <= 0.0 {
        warnings.push(Finding::new("thrust_falls_with_rate", "thrust_coefficient"));
        return None;
    }
    Some(ThrustCurve {
        coefficient,
        hover_rate,
        slope: coefficient.scaled(2.0 * hover_rate),
        offset: coefficient.scaled(-hover_rate * hover_rate),
        residual_rms: fit.residual_rms,
        samples: rows.len(),
        linear_share,
    })
}
