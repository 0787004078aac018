//! g(u) from slow ramps, [LPC16] Eqs. (7)-(9); its degree; and whether the ramps were slow enough for Eq. (4).
//!
//! **Deviation:** y_g = ω_p + k_V (v_bmax - v_b). The print has the other sign below Eq. (9), which contradicts
//! its Eq. (6).
//!
//! **Deviation:** to (9) the print fits the powers of u alone. Here the powers are taken as they arrive behind the
//! lag of the rotor ([`ramp_lag`](super::ramp_lag)): left in the residual it would pass for noise that never averages
//! out.

use super::thresholds::THRESHOLDS;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Estimate;
use super::ramp_lag::{self, KnownLag};
use super::steady_rows::{HIGHEST_DEGREE, SteadyRows, goes_both_ways};
use crate::estimation::inversion::invert;
use crate::estimation::least_squares::{self, LinearFit};
use crate::estimation::moments::{mean, mean_and_error};
use crate::model::polynomial;
use crate::screening::rotor_data::bounds;

/// How one degree did.
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct RampCheck {
    /// [1/s] largest slope of the command.
    pub fastest_slope: f64,
    /// [s] fitted lag of the rate behind Eq. (4).
    pub lag: Estimate,
    /// [rad/s] error that lag makes on the fastest ramp.
    pub error: f64,
    /// Whether that error is small enough for Eq. (4), or ramps that go one way do not separate the lag from the curve.
    pub slow_enough: bool,
    /// Whether g(u) was fitted behind the lag, so that the error is not in it.
    pub lag_fitted: bool,
}

/// The fitted curve g(u).
#[cfg_attr(test, derive(schemars::JsonSchema))]
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

/// Fits Eq. (9). `gain_error` [rad/(s V)] is the standard error of k_V, which widens that of the curve.
/// `degree` fixes the degree; without it cross-validation chooses. `known` is how the rotor follows its command, where
/// other logs show.
pub(crate) fn identify(
    rows: &SteadyRows,
    gain_error: f64,
    degree: Option<usize>,
    known: Option<KnownLag>,
) -> Option<StaticCurve> {
    let y = DVector::from_column_slice(&rows.corrected_rate);
    let at_first = || compare_degrees(&rows.command, &y);
    let first = if degree.is_some() { None } else { Some(at_first()?) };
    let shape = degree.or(first.as_ref().map(|(_, preferred)| *preferred))?;
    let beside = beside_lag(rows, shape, &y);
    let lag = ramp_lag::choose(rows, beside.as_ref().map(Beside::lag), known);
    let without_lag = lag.and_then(|lag| ramp_lag::without_lag(rows, &lag));
    let again = without_lag.and_then(|(command, rate)| compare_degrees(&command, &DVector::from_vec(rate)));
    let (degrees, preferred_degree) = again.or(first).or_else(at_first)?;
    let degree = degree.unwrap_or(preferred_degree);
    let behind = lag.and_then(|lag| ramp_lag::identify(rows, degree, &lag, gain_error));
    let is_behind = behind.is_some();
    let (coefficients, residual_rms) = behind.or_else(|| at_once(rows, degree, &y, gain_error))?;
    Some(StaticCurve {
        coefficients,
        degrees,
        preferred_degree,
        residual_rms,
        samples: rows.command.len(),
        range: bounds(&rows.command),
        from_ramps: rows.from_ramps,
        ramp_check: beside.map(|beside| check_ramp(rows, &beside, is_behind || goes_both_ways(rows))),
    })
}

/// Degrees 1 to 4 side by side, and the one that cross-validation prefers.
fn compare_degrees(command: &[f64], y: &DVector<f64>) -> Option<(Vec<DegreeScore>, usize)> {
    let (degrees, preferred) = degrees_beside(bounds(command), |degree| {
        let fit = least_squares::least_squares(&powers(command, degree), y)?;
        let coefficients = fit.coefficients.iter().copied().collect();
        Some((coefficients, fit.residual_rms, held_out(command, y, degree)?))
    });
    Some((degrees, preferred?))
}

/// Each degree's coefficients, the rms that it leaves, and its squared errors held out, side by side; and the lowest degree whose
/// held-out error is hardly above the best and whose curve rises over `range`.
pub(super) fn degrees_beside(
    range: (f64, f64),
    each: impl Fn(usize) -> Option<(Vec<f64>, f64, Vec<f64>)>,
) -> (Vec<DegreeScore>, Option<usize>) {
    let (mut scores, mut blocks) = (Vec::new(), Vec::new());
    for degree in 1..=HIGHEST_DEGREE {
        let Some((coefficients, train, squares)) = each(degree) else { continue };
        scores.push(DegreeScore { degree, train, held_out: mean(&squares).sqrt(), coefficients });
        blocks.push(squares);
    }
    let preferred = simplest_rising(&scores, &blocks, range);
    (scores, preferred)
}

/// The powers as they are; where the ramps go up and down, the lag -g'(u) u̇ / p beside them. The coefficients, and the
/// rms of the residual [rad/s].
fn at_once(
    rows: &SteadyRows,
    degree: usize,
    y: &DVector<f64>,
    gain_error: f64,
) -> Option<(Vec<Estimate>, f64)> {
    let beside = if goes_both_ways(rows) { beside_lag(rows, degree, y) } else { None };
    let (design, fit) = match beside {
        Some(beside) => (beside.design, beside.with_lag),
        None => {
            let design = powers(&rows.command, degree);
            let fit = least_squares::least_squares(&design, y)?;
            (design, fit)
        }
    };
    let mut coefficients = with_gain_error(&fit, &design, &rows.voltage_drop, gain_error)?;
    coefficients.truncate(degree);
    Some((coefficients, fit.residual_rms))
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
    let inverse = invert(&(design.transpose() * design))?;
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
    let block_of = |row: usize| row * THRESHOLDS.curve_blocks / rows;
    let mut errors = vec![(0.0, 0usize); THRESHOLDS.curve_blocks];
    for fold in 0..THRESHOLDS.curve_folds {
        let (held, kept): (Vec<usize>, Vec<usize>) =
            (0..rows).partition(|&row| block_of(row) % THRESHOLDS.curve_folds == fold);
        let kept_command: Vec<f64> = kept.iter().map(|&row| command[row]).collect();
        let kept_y = DVector::from_iterator(kept.len(), kept.iter().map(|&row| y[row]));
        let fit = least_squares::least_squares(&powers(&kept_command, degree), &kept_y)?;
        for row in held {
            let error = y[row] - command[row] * polynomial(fit.coefficients.as_slice(), command[row]);
            let entry = &mut errors[block_of(row)];
            *entry = (entry.0 + error * error, entry.1 + 1);
        }
    }
    Some(errors.into_iter().filter(|entry| entry.1 > 0).map(|(sum, count)| sum / count as f64).collect())
}

/// The simplest degree among those whose curve rises over the commands that were logged, where there is one: no rotor turns slower for more.
/// Where its curve falls beyond them, the simplest that does as well and rises over all commands: a model is asked for those, too.
pub(crate) fn simplest_rising(
    scores: &[DegreeScore],
    blocks: &[Vec<f64>],
    range: (f64, f64),
) -> Option<usize> {
    let both = scores.iter().zip(blocks).filter(|(score, _)| falls(&score.coefficients, range).is_none());
    let (rising, own): (Vec<DegreeScore>, Vec<Vec<f64>>) =
        both.map(|(score, blocks)| (score.clone(), blocks.clone())).unzip();
    let chosen = simplest(&rising, &own).or_else(|| simplest(scores, blocks))?;
    let falls_beyond = |score: &DegreeScore| falls(&score.coefficients, THRESHOLDS.all_commands).is_some();
    let own = scores.iter().find(|score| score.degree == chosen).filter(|score| falls_beyond(score));
    let does_as_well = |score: &&DegreeScore, own: &DegreeScore| {
        score.held_out.powi(2) <= (1.0 + THRESHOLDS.hardly_better_degree) * own.held_out.powi(2)
    };
    let instead = own.and_then(|own| rising.iter().find(|it| does_as_well(it, own) && !falls_beyond(it)));
    Some(instead.map_or(chosen, |score| score.degree))
}

/// [-] the commands between which a curve of these coefficients falls, of those in `range`.
pub(crate) fn falls(coefficients: &[f64], (low, high): (f64, f64)) -> Option<(f64, f64)> {
    let points = THRESHOLDS.curve_points;
    let at = |point: usize| low + (high - low) * point as f64 / points as f64;
    let curve = |point: usize| at(point) * polynomial(coefficients, at(point));
    let least = THRESHOLDS.falling_curve_share * (curve(points) - curve(0)).abs();
    let mut top = 0;
    for point in 1..=points {
        if curve(point) >= curve(top) {
            top = point;
        } else if curve(top) - curve(point) > least {
            let last = (point..points).find(|next| curve(next + 1) >= curve(*next)).unwrap_or(points);
            return Some((at(top), at(last)));
        }
    }
    None
}

/// The lowest degree whose held-out error is not significantly above the best: block by block, the mean
/// difference of the squared errors is within `degree_errors` standard errors, and the error itself is not far above it: where the
/// difference is all in one block, its standard error is as large as itself.
pub(crate) fn simplest(scores: &[DegreeScore], blocks: &[Vec<f64>]) -> Option<usize> {
    let best = (0..scores.len()).min_by(|&a, &b| scores[a].held_out.total_cmp(&scores[b].held_out))?;
    let near = |errors: &Vec<f64>| {
        let differences: Vec<f64> = errors.iter().zip(&blocks[best]).map(|(a, b)| a - b).collect();
        let (mean, error) = mean_and_error(&differences);
        let most = THRESHOLDS.degree_squares * scores[best].held_out.powi(2);
        mean <= THRESHOLDS.degree_errors * error && scores[best].held_out.powi(2) + mean <= most
    };
    let at = blocks.iter().position(near).unwrap_or(best);
    scores.get(at).map(|score| score.degree)
}

/// Powers of the command and the lag behind a ramp, fitted side by side.
struct Beside {
    /// The powers, and the lag last.
    design: DMatrix<f64>,
    /// Without the lag.
    alone: LinearFit,
    with_lag: LinearFit,
}

impl Beside {
    /// [s]
    fn lag(&self) -> Estimate {
        let index = self.design.ncols() - 1;
        Estimate {
            value: self.with_lag.coefficients[index],
            standard_error: self.with_lag.standard_error(index),
        }
    }
}

/// On a ramp that has lasted, a lag 1/p leaves ω behind g(u) by g'(u) u̇ / p: that column beside the powers.
fn beside_lag(rows: &SteadyRows, degree: usize, y: &DVector<f64>) -> Option<Beside> {
    if !rows.from_ramps {
        return None;
    }
    let design = powers(&rows.command, degree);
    let alone = least_squares::least_squares(&design, y)?;
    let behind = behind(rows, alone.coefficients.as_slice());
    let mut design = design.insert_column(degree, 0.0);
    design.set_column(degree, &DVector::from_vec(behind));
    let with_lag = least_squares::least_squares(&design, y)?;
    Some(Beside { design, alone, with_lag })
}

/// [rad/s²] -g'(u) u̇ of each row.
fn behind(rows: &SteadyRows, coefficients: &[f64]) -> Vec<f64> {
    let slope_of_curve = |u: f64| -> f64 {
        coefficients.iter().enumerate().map(|(j, c)| (j + 1) as f64 * c * u.powi(j as i32)).sum()
    };
    rows.command.iter().zip(&rows.slope).map(|(&u, slope)| -slope_of_curve(u) * slope).collect()
}

/// Whether the lag, fitted from ramps up against ramps down, is small enough for Eq. (4).
fn check_ramp(rows: &SteadyRows, beside: &Beside, lag_fitted: bool) -> RampCheck {
    let coefficients = beside.alone.coefficients.as_slice();
    let lag = beside.lag();
    let steepest = behind(rows, coefficients).iter().fold(0.0f64, |most, value| most.max(value.abs()));
    let error = lag.value.abs() * steepest;
    let (low, high) = bounds(&rows.command);
    let curve = |u: f64| u * polynomial(coefficients, u);
    let range = (curve(high) - curve(low)).abs();
    let fastest_slope = rows.slope.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    let seen = goes_both_ways(rows) || lag.value > THRESHOLDS.ramp_lag_errors * lag.standard_error;
    let slow_enough = !seen || error < THRESHOLDS.ramp_lag_share * range.max(f64::MIN_POSITIVE);
    RampCheck { fastest_slope, lag, error, slow_enough, lag_fitted }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_that_falls_among_the_logged_commands_is_not_chosen() {
        let score = |held_out: f64, coefficients: &[f64]| DegreeScore {
            degree: coefficients.len(),
            train: held_out,
            held_out,
            coefficients: coefficients.to_vec(),
        };
        let scores = [score(15.0, &[1_400.0]), score(9.0, &[3_000.0, -2_000.0])];
        let blocks = [vec![225.0; 8], vec![81.0; 8]];
        assert_eq!(simplest_rising(&scores, &blocks, (0.1, 0.7)), Some(2));
        assert_eq!(simplest_rising(&scores, &blocks, (0.1, 1.0)), Some(1));
        let (from, to) =
            falls(&scores[1].coefficients, (0.1, 1.0)).expect("it falls from its top at 0.75 on");
        assert!((from - 0.75).abs() < 0.01 && to == 1.0, "{from} {to}");
        assert_eq!(simplest_rising(&scores[1..], &blocks[1..], (0.1, 1.0)), Some(2), "no other is there");
    }

    /// Over a narrow range a higher degree may gain a hair by turning down beyond it.
    #[test]
    fn of_curves_that_do_as_well_one_that_rises_over_all_commands_is_chosen() {
        let score = |held_out: f64, coefficients: &[f64]| DegreeScore {
            degree: coefficients.len(),
            train: held_out,
            held_out,
            coefficients: coefficients.to_vec(),
        };
        let chosen = |of_straight: f64| {
            let scores = [score(of_straight, &[1_000.0, 340.0]), score(2.0, &[800.0, 1_500.0, -1_600.0])];
            // Plainly better in each block, by however little.
            let blocks = [vec![of_straight.powi(2); 8], vec![4.0; 8]];
            simplest_rising(&scores, &blocks, (0.3, 0.5))
        };
        assert_eq!(chosen(2.005), Some(2), "half a percent of the squares");
        assert_eq!(chosen(2.1), Some(3), "a tenth of them");
    }

    /// Squared errors of three degrees in eight blocks: what the lowest leaves in its last block, and the middle one everywhere.
    fn chosen(in_one_block: f64, everywhere: f64) -> Option<usize> {
        let blocks: Vec<Vec<f64>> = [[1.0, in_one_block], [everywhere, everywhere], [1.0, 1.0]]
            .iter()
            .map(|[others, last]| {
                // The blocks scatter by a tenth: a difference has a standard error.
                let mut block: Vec<f64> = (0..8).map(|row| others + 0.1 * f64::from(row % 2)).collect();
                block[7] = *last;
                block
            })
            .collect();
        let score = |(at, block): (usize, &Vec<f64>)| DegreeScore {
            degree: at + 1,
            train: 1.0,
            held_out: (block.iter().sum::<f64>() / block.len() as f64).sqrt(),
            coefficients: Vec::new(),
        };
        let scores: Vec<DegreeScore> = blocks.iter().enumerate().map(score).collect();
        simplest(&scores, &blocks)
    }

    #[test]
    fn a_degree_whose_error_is_all_in_one_block_is_not_taken() {
        assert_eq!(chosen(1.0, 2.0), Some(1), "no difference");
        // Within two standard errors of the best in both: of 1.2 and of 27 times its squared error.
        assert_eq!(chosen(2.5, 2.0), Some(1));
        assert_eq!(chosen(200.0, 2.0), Some(3), "the middle one is plainly worse");
        assert_eq!(chosen(200.0, 1.0), Some(2));
    }
}
