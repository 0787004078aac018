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

/// Those of all logs; `None` of too few. Of rows that are levels each, fewer are enough.
fn all_pairs(logs: &[ScreenedLog], rotors: &[usize]) -> Option<Vec<(f64, f64)>> {
    let of_log = |log| rotors.iter().flat_map(move |number| pairs(log, *number));
    let rows: Vec<(f64, f64)> = logs.iter().flat_map(of_log).collect();
    let mut read = logs.iter().flat_map(ScreenedLog::rotors).filter(|it| rotors.contains(&it.number()));
    let are_points = read.all(|rotor| rotor.data().rows_are_levels());
    let fewest = if are_points { THRESHOLDS.fewest_points } else { THRESHOLDS.fewest_thrust_rows };
    (rows.len() >= fewest).then_some(rows)
}

/// [N s²/rad²] c where an offset of the load cell is fitted beside it; `None` where the rates do not tell the two apart, or the offset
/// is none.
fn beside_offset(rows: &[(f64, f64)], thrust: &DVector<f64>) -> Option<Estimate> {
    let design =
        DMatrix::from_fn(rows.len(), 2, |row, column| if column == 0 { rows[row].0.powi(2) } else { 1.0 });
    let fit = least_squares::least_squares(&design, thrust)?;
    let estimate =
        |index: usize| Estimate { value: fit.coefficients[index], standard_error: fit.standard_error(index) };
    let (risen, offset) = (estimate(0), estimate(1));
    let is_there = offset.value.abs() > THRESHOLDS.linear_thrust_errors * offset.standard_error;
    is_there.then_some(risen)
}

/// Fits the thrust curve over the rotors of these numbers; `None` where no thrust was measured.
pub(crate) fn identify(
    logs: &[ScreenedLog],
    rotors: &[usize],
    hover_rate: f64,
    warnings: &mut Vec<Finding>,
) -> Option<ThrustCurve> {
    let rows = all_pairs(logs, rotors)?;
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
    // A load cell that shows something at rest: c is what rises with the rate, and nobody knows it better than the two ways to fit it
    // agree.
    let risen = beside_offset(&rows, &y);
    if coefficient.value <= 0.0 || risen.is_some_and(|risen| risen.value < risen.standard_error) {
        warnings.push(Finding::new("thrust_falls_with_rate", "thrust_coefficient"));
        return None;
    }
    if linear_share.value.abs() > THRESHOLDS.linear_thrust_share
        && linear_share.value.abs() > THRESHOLDS.linear_thrust_errors * linear_share.standard_error
    {
        let linear = Finding::new("thrust_not_quadratic", "thrust_coefficient");
        warnings.push(linear.with("linear_share", linear_share.value));
    }
    let apart = risen.map_or(0.0, |risen| risen.value - coefficient.value);
    let coefficient = Estimate { standard_error: coefficient.standard_error.hypot(apart), ..coefficient };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;

    /// A thrust stand at levels of 100 to 900 rad/s whose cell shows `offset` [N] at rest, and `c` ω² more.
    fn found(c: f64, offset: f64) -> (Option<ThrustCurve>, Vec<Finding>) {
        let rows = 0..400_i32;
        let rate = |row: i32| 100.0 + 100.0 * f64::from(row / 50);
        let noise = |row: i32| 0.01 * f64::from((row * 37 % 11) - 5);
        let mut log =
            Dataset::new("stand", "", rows.clone().map(|row| 0.02 * f64::from(row)).collect()).unwrap();
        let mut add = |name: &str, of: &dyn Fn(i32) -> f64| {
            log.insert(name, rows.clone().map(of).collect()).unwrap();
        };
        add("command_1", &|row| rate(row) / 1_000.0);
        add("propeller_rate_1_rad_s", &rate);
        add("thrust_1_n", &|row| c * rate(row).powi(2) + offset + noise(row));
        let mut findings = Vec::new();
        (identify(&[log.into()], &[1], 617.0, &mut findings), findings)
    }

    #[test]
    fn an_offset_of_the_cell_widens_what_is_known_of_the_thrust() {
        let plain = found(8e-6, 0.0).0.expect("a curve").coefficient;
        assert!((plain.value / 8e-6 - 1.0).abs() < 0.01 && plain.standard_error < 1e-7, "{plain:?}");
        let beside = found(8e-6, 1.0).0.expect("a curve").coefficient;
        assert!(beside.value > 9e-6, "{beside:?}");
        assert!((beside.value - 8e-6) < 1.5 * beside.standard_error, "{beside:?}");
    }

    /// No propeller: all that the cell shows is its offset, and what rises with the rate is none.
    #[test]
    fn a_cell_that_shows_only_its_offset_has_no_thrust_curve() {
        let (curve, findings) = found(-4e-8, 0.15);
        assert!(curve.is_none());
        assert!(findings.iter().any(|it| it.code == "thrust_falls_with_rate"), "{findings:?}");
    }
}
