//! g(u) from slow ramps, [LPC16] Eqs. (7)-(9); its degree; and whether the ramps were slow enough for Eq. (4).
//!
//! **Deviation:** y_g = ω_p + k_V (v_bmax - v_b). The print has the other sign below Eq. (9), which contradicts
//! its Eq. (6).
//!
//! **Deviation:** to (9) the print fits the powers of u alone. Where the ramps go up and down, the lag of the rotor
//! behind them, g'(u) u̇ / p, is fitted beside: left in the residual it would pass for noise that never averages out.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Estimate;
use super::linear::{self, LinearFit};
use super::rotor_log::{Motion, RotorLog};

/// Highest degree tried, as the paper compares several.
pub const HIGHEST_DEGREE: usize = 4;
/// Folds of the cross-validation, each of blocks spread over the whole record.
const FOLDS: usize = 5;
/// Blocks of neighbouring samples that stay together in one fold.
const BLOCKS: usize = 40;
/// [-] range of commands below which a curve is not worth fitting.
const NARROWEST: f64 = 0.05;
/// Share of the curve's range that a ramp's lag may take before it is called too fast.
const LAG_SHARE: f64 = 0.005;

/// Rows for Eq. (9).
pub(super) struct SteadyRows {
    /// [-]
    pub command: Vec<f64>,
    /// [rad/s] y_g.
    pub corrected_rate: Vec<f64>,
    /// [V] v_bmax - v_b.
    pub voltage_drop: Vec<f64>,
    /// [1/s] slope of the command.
    pub slope: Vec<f64>,
    /// Whether ramps gave them (else constant levels).
    pub from_ramps: bool,
}

/// How one degree did.
#[derive(Debug, Clone, Serialize)]
pub struct DegreeScore {
    /// Degree of the polynomial without constant term.
    pub degree: usize,
    /// [rad/s] rms error on the samples it was fitted to.
    pub train: f64,
    /// [rad/s] rms error on samples held out.
    pub held_out: f64,
    /// Coefficients of u, u², ...
    pub coefficients: Vec<f64>,
}

/// The lag seen between ramps up and ramps down.
#[derive(Debug, Clone, Serialize)]
pub struct RampCheck {
    /// [1/s] largest slope of the command.
    pub fastest_slope: f64,
    /// [s] fitted lag of the rate behind Eq. (4).
    pub lag: Estimate,
    /// [rad/s] error that lag makes on the fastest ramp.
    pub error: f64,
    /// Whether that error is small enough for Eq. (4).
    pub slow_enough: bool,
}

/// The fitted curve g(u).
#[derive(Debug, Clone, Serialize)]
pub struct StaticCurve {
    /// `c_gj` of u^j, from j = 1: linear (the paper's c_g2), quadratic (its c_g1), ...
    pub coefficients: Vec<Estimate>,
    /// Degrees 1 to 4 side by side.
    pub degrees: Vec<DegreeScore>,
    /// Degree that cross-validation prefers.
    pub preferred_degree: usize,
    /// [rad/s] rms of e_g.
    pub residual_rms: f64,
    /// Samples used.
    pub samples: usize,
    /// [-] lowest and highest command.
    pub range: (f64, f64),
    /// Where the rows came from: ramps, or constant levels.
    pub from_ramps: bool,
    /// Were the ramps slow enough?
    pub ramp_check: Option<RampCheck>,
}

/// Collects steady rows: ramps if there are any worth it, else constant levels.
pub(super) fn steady_rows(rotors: &[RotorLog], gain: f64, full_voltage: f64) -> Option<SteadyRows> {
    let ramps = collect(rotors, Motion::Ramp, gain, full_voltage);
    if ramps.command.len() >= 100 && spread(&ramps.command) >= NARROWEST {
        return Some(ramps);
    }
    let levels = collect(rotors, Motion::Constant, gain, full_voltage);
    (levels.command.len() >= 100 && spread(&levels.command) >= NARROWEST).then_some(levels)
}

fn spread(values: &[f64]) -> f64 {
    let (low, high) = super::rotor_log::bounds(values);
    high - low
}

fn collect(rotors: &[RotorLog], wanted: Motion, gain: f64, full_voltage: f64) -> SteadyRows {
    let mut rows = SteadyRows {
        command: Vec::new(),
        corrected_rate: Vec::new(),
        voltage_drop: Vec::new(),
        slope: Vec::new(),
        from_ramps: wanted == Motion::Ramp,
    };
    for rotor in rotors {
        for (_, part) in rotor.steady().into_iter().filter(|(motion, _)| *motion == wanted) {
            // Slope over a quarter of a second: quantized commands stand still between steps.
            let reach = ((0.125 / rotor.interval).ceil() as usize).max(1);
            for row in part.clone() {
                let voltage = rotor.voltage.as_ref().map_or(full_voltage, |voltage| voltage[row]);
                if !rotor.rate[row].is_finite() || !voltage.is_finite() {
                    continue;
                }
                let (before, after) =
                    (row.saturating_sub(reach).max(part.start), (row + reach).min(part.end - 1));
                let span = (rotor.time[after] - rotor.time[before]).max(f64::MIN_POSITIVE);
                rows.slope.push((rotor.command[after] - rotor.command[before]) / span);
                rows.command.push(rotor.command[row]);
                rows.voltage_drop.push(full_voltage - voltage);
                // Plus: see the head of this file.
                rows.corrected_rate.push(rotor.rate[row] + gain * (full_voltage - voltage));
            }
        }
    }
    rows
}

/// Fits Eq. (9). `gain_error` [rad/(s V)] is the standard error of k_V, which widens that of the curve.
/// `degree` fixes the degree; without it cross-validation chooses.
pub(super) fn identify(rows: &SteadyRows, gain_error: f64, degree: Option<usize>) -> Option<StaticCurve> {
    let y = DVector::from_column_slice(&rows.corrected_rate);
    let mut degrees = Vec::new();
    let mut blocks = Vec::new();
    for degree in 1..=HIGHEST_DEGREE {
        let fit = linear::least_squares(&powers(&rows.command, degree), &y);
        let (Some(fit), Some(errors)) = (fit, held_out(&rows.command, &y, degree)) else { continue };
        degrees.push(DegreeScore {
            degree,
            train: fit.residual_rms,
            held_out: (errors.iter().sum::<f64>() / errors.len() as f64).sqrt(),
            coefficients: fit.coefficients.iter().copied().collect(),
        });
        blocks.push(errors);
    }
    let preferred_degree = simplest(&degrees, &blocks)?;
    let degree = degree.unwrap_or(preferred_degree);
    let mut design = powers(&rows.command, degree);
    let mut fit = linear::least_squares(&design, &y)?;
    let mut ramp_check = None;
    if let Some((wider, with_lag)) = beside_lag(rows, &fit, &design, &y) {
        ramp_check = Some(check_ramp(rows, &fit, &with_lag));
        if goes_both_ways(rows) {
            (design, fit) = (wider, with_lag);
        }
    }
    let coefficients = with_gain_error(&fit, &design, &rows.voltage_drop, gain_error)?;
    let coefficients = coefficients[..degree].to_vec();
    Some(StaticCurve {
        coefficients,
        degrees,
        preferred_degree,
        residual_rms: fit.residual_rms,
        samples: rows.command.len(),
        range: super::rotor_log::bounds(&rows.command),
        from_ramps: rows.from_ramps,
        ramp_check,
    })
}

fn powers(command: &[f64], degree: usize) -> DMatrix<f64> {
    DMatrix::from_fn(command.len(), degree, |row, column| command[row].powi(column as i32 + 1))
}

/// An error of k_V shifts y_g by the voltage drop times that error: its part is added to the covariance.
fn with_gain_error(
    fit: &LinearFit,
    design: &DMatrix<f64>,
    voltage_drop: &[f64],
    gain_error: f64,
) -> Option<Vec<Estimate>> {
    let inverse = linear::invert(&(design.transpose() * design))?;
    let shift = inverse * (design.transpose() * DVector::from_column_slice(voltage_drop)) * gain_error;
    let estimate = |(index, value): (usize, &f64)| Estimate {
        value: *value,
        standard_error: fit.standard_error(index).hypot(shift[index]),
    };
    Some(fit.coefficients.iter().enumerate().map(estimate).collect())
}

/// Held-out squared error of each block.
fn held_out(command: &[f64], y: &DVector<f64>, degree: usize) -> Option<Vec<f64>> {
    let rows = command.len();
    let block_of = |row: usize| row * BLOCKS / rows;
    let mut errors = vec![(0.0, 0usize); BLOCKS];
    for fold in 0..FOLDS {
        let (held, kept): (Vec<usize>, Vec<usize>) =
            (0..rows).partition(|&row| block_of(row) % FOLDS == fold);
        let kept_command: Vec<f64> = kept.iter().map(|&row| command[row]).collect();
        let kept_y = DVector::from_iterator(kept.len(), kept.iter().map(|&row| y[row]));
        let fit = linear::least_squares(&powers(&kept_command, degree), &kept_y)?;
        for row in held {
            let error = y[row] - polynomial(fit.coefficients.as_slice(), command[row]);
            let entry = &mut errors[block_of(row)];
            *entry = (entry.0 + error * error, entry.1 + 1);
        }
    }
    Some(errors.into_iter().filter(|entry| entry.1 > 0).map(|(sum, count)| sum / count as f64).collect())
}

/// Σ c_j u^j from j = 1, in words.
pub(super) fn formula(coefficients: &[f64]) -> String {
    let term = |(at, value): (usize, &f64)| {
        let power = match at {
            0 => "u".to_owned(),
            at => format!("u^{}", at + 1),
        };
        format!("{} {power}", crate::unit::short(*value))
    };
    coefficients.iter().enumerate().map(term).collect::<Vec<String>>().join(" + ").replace("+ -", "- ")
}

/// Σ c_j u^j from j = 1.
pub(super) fn polynomial(coefficients: &[f64], u: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| (sum + c) * u)
}

/// The lowest degree whose held-out error is not significantly above the best: block by block, the mean
/// difference of the squared errors is within one standard error.
pub(super) fn simplest(scores: &[DegreeScore], blocks: &[Vec<f64>]) -> Option<usize> {
    let best = (0..scores.len()).min_by(|&a, &b| scores[a].held_out.total_cmp(&scores[b].held_out))?;
    let near = |errors: &Vec<f64>| {
        let differences: Vec<f64> = errors.iter().zip(&blocks[best]).map(|(a, b)| a - b).collect();
        let count = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / count;
        let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        mean <= (variance / count).sqrt()
    };
    let at = blocks.iter().position(near).unwrap_or(best);
    scores.get(at).map(|score| score.degree)
}

/// Whether the command rises and falls for at least a fifth of the rows each: only then does the lag of the rotor
/// look different from the curve.
fn goes_both_ways(rows: &SteadyRows) -> bool {
    let share = |way: fn(f64) -> bool| {
        rows.slope.iter().filter(|slope| way(**slope)).count() as f64 / rows.slope.len().max(1) as f64
    };
    share(|slope| slope > 0.0) > 0.2 && share(|slope| slope < 0.0) > 0.2
}

/// On a ramp a lag 1/p leaves ω behind g(u) by g'(u) u̇ / p: that column beside the powers, and the fit with it.
fn beside_lag(
    rows: &SteadyRows,
    fit: &LinearFit,
    design: &DMatrix<f64>,
    y: &DVector<f64>,
) -> Option<(DMatrix<f64>, LinearFit)> {
    if !rows.from_ramps {
        return None;
    }
    let behind = behind(rows, fit.coefficients.as_slice());
    let mut wider = design.clone().insert_column(design.ncols(), 0.0);
    wider.set_column(design.ncols(), &DVector::from_vec(behind));
    let with_lag = linear::least_squares(&wider, y)?;
    Some((wider, with_lag))
}

/// [rad/s²] -g'(u) u̇ of each row.
fn behind(rows: &SteadyRows, coefficients: &[f64]) -> Vec<f64> {
    let slope_of_curve = |u: f64| -> f64 {
        coefficients.iter().enumerate().map(|(j, c)| (j + 1) as f64 * c * u.powi(j as i32)).sum()
    };
    rows.command.iter().zip(&rows.slope).map(|(&u, slope)| -slope_of_curve(u) * slope).collect()
}

/// Whether the lag, fitted from ramps up against ramps down, is small enough for Eq. (4).
fn check_ramp(rows: &SteadyRows, fit: &LinearFit, with_lag: &LinearFit) -> RampCheck {
    let coefficients = fit.coefficients.as_slice();
    let index = coefficients.len();
    let lag =
        Estimate { value: with_lag.coefficients[index], standard_error: with_lag.standard_error(index) };
    let steepest = behind(rows, coefficients).iter().fold(0.0f64, |most, value| most.max(value.abs()));
    let error = lag.value.abs() * steepest;
    let (low, high) = super::rotor_log::bounds(&rows.command);
    let range = (polynomial(coefficients, high) - polynomial(coefficients, low)).abs();
    let fastest_slope = rows.slope.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    RampCheck { fastest_slope, lag, error, slow_enough: error < LAG_SHARE * range.max(f64::MIN_POSITIVE) }
}
