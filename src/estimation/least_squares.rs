//! Linear least squares and instrumental variables, with standard errors that allow for correlated residuals.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::autocorrelation::memory;
use super::inversion::invert;
use super::robust_errors::{blocks, widened};

/// A fitted linear model.
#[derive(Debug, Clone)]
pub(crate) struct LinearFit {
    /// Coefficients, in the order of the design's columns.
    pub coefficients: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// [unit of y] rms of the residual.
    pub residual_rms: f64,
    /// What is left: y minus the model.
    pub residuals: DVector<f64>,
}

impl LinearFit {
    /// Standard error of one coefficient.
    pub fn standard_error(&self, index: usize) -> f64 {
        self.covariance[(index, index)].max(0.0).sqrt()
    }
}

impl LinearFit {
    /// Sum of squares that each row leaves when it is left out of the ordinary fit to `design`, which this is: by its leverage,
    /// without a fit of its own (Allen 1974, PRESS). Infinite where the columns do not determine the coefficients.
    pub fn left_out(&self, design: &DMatrix<f64>) -> f64 {
        let Some(inverse) = (design.transpose() * design).try_inverse() else { return f64::INFINITY };
        let of = |row: usize| {
            let own = design.row(row);
            let leverage = (own * &inverse * own.transpose())[(0, 0)];
            (self.residuals[row] / (1.0 - leverage).max(f64::EPSILON)).powi(2)
        };
        (0..design.nrows()).map(of).sum()
    }
}

/// Least squares of `y` on the columns of `design`; `None` when the columns do not determine the coefficients.
pub(crate) fn least_squares(design: &DMatrix<f64>, y: &DVector<f64>) -> Option<LinearFit> {
    instrumental(design.as_view(), design.as_view(), y)
}

/// The first `powers` powers of time, from the constant on, when time goes from -1 to 1: a smooth course.
pub(crate) fn smooth_course(time: &[f64], powers: usize) -> DMatrix<f64> {
    let (first, last) = (time[0], time[time.len() - 1]);
    let place = |at: usize| 2.0 * (time[at] - first) / (last - first) - 1.0;
    DMatrix::from_fn(time.len(), powers, |at, power| place(at).powi(power as i32))
}

/// Two-stage least squares: the columns of `design` may carry measurement noise, those of `instruments` must
/// not share it. With `instruments` = `design` it is ordinary least squares.
///
/// The covariance is that of white residuals, widened for each coefficient by the one from sums of scores
/// over blocks of time where that is larger, so that intervals hold with correlated residuals.
pub(crate) fn instrumental(
    design: DMatrixView<f64>,
    instruments: DMatrixView<f64>,
    y: &DVector<f64>,
) -> Option<LinearFit> {
    let (rows, columns) = design.shape();
    if rows <= columns + 1 {
        return None;
    }
    let first_stage = invert(&instruments.tr_mul(&instruments))? * instruments.tr_mul(&design);
    // In blocks: beside long columns there is no room for as much again.
    let fitted = |rows: &Range<usize>| instruments.rows(rows.start, rows.len()) * &first_stage;
    let (mut squares, mut products) = (DMatrix::zeros(columns, columns), DVector::zeros(columns));
    for block in blocks(rows) {
        let fitted = fitted(&block);
        squares += fitted.tr_mul(&fitted);
        products += fitted.tr_mul(&y.rows(block.start, block.len()));
    }
    let inverse = invert(&squares)?;
    let coefficients = &inverse * products;
    let mut residuals = y.clone();
    residuals.gemv(-1.0, &design, &coefficients, 1.0);
    let variance = residuals.norm_squared() / (rows - columns) as f64;
    let white = &inverse * variance;
    let scores = |block: Range<usize>| fitted(&block).tr_mul(&residuals.rows(block.start, block.len()));
    let scores: Vec<DVector<f64>> = blocks(rows).map(scores).collect();
    let covariance = widened(&white, &inverse, &scores, rows, memory(residuals.as_slice()));
    let residual_rms = (residuals.norm_squared() / rows as f64).sqrt();
    Some(LinearFit { coefficients, covariance, residual_rms, residuals })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    fn noise(random: &mut rand_chacha::ChaCha8Rng) -> f64 {
        random.sample(StandardNormal)
    }

    /// 95 % intervals of a slope under strongly correlated residuals (lag-one correlation 0.9).
    #[test]
    fn intervals_hold_under_correlated_residuals() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let (runs, rows) = (300, 2000);
        let mut inside = 0;
        for _ in 0..runs {
            let mut colored = 0.0;
            let y = DVector::from_fn(rows, |row, _| {
                colored = 0.9 * colored + noise(&mut random);
                2.0 * (row as f64 / rows as f64) + colored
            });
            let design = DMatrix::from_fn(
                rows,
                2,
                |row, column| {
                    if column == 0 { 1.0 } else { row as f64 / rows as f64 }
                },
            );
            let fit = least_squares(&design, &y).unwrap();
            inside += usize::from((fit.coefficients[1] - 2.0).abs() < 1.96 * fit.standard_error(1));
        }
        let share = inside as f64 / f64::from(runs);
        // White standard errors cover about 35 % here. Of 300 runs at 95 %, 90 % and 99 % are 4 and 3.2 standard
        // deviations of the binomial away.
        assert!((0.9..=0.99).contains(&share), "covered {share}");
    }

    #[test]
    fn what_a_row_leaves_when_left_out_is_that_of_the_fit_without_it() {
        let (x, y) = ([1.0, 2.0, 3.0, 5.0, 8.0], [1.2, 1.9, 3.3, 4.7, 8.4]);
        let design = |x: &[f64]| DMatrix::from_fn(x.len(), 2, |row, column| x[row].powi(column as i32));
        let fit = least_squares(&design(&x), &DVector::from_row_slice(&y)).expect("determined");
        let without = |row: usize| {
            let rest =
                |of: &[f64; 5]| -> Vec<f64> { (0..5).filter(|at| *at != row).map(|at| of[at]).collect() };
            let (x_rest, y_rest) = (rest(&x), rest(&y));
            let fit = least_squares(&design(&x_rest), &DVector::from_row_slice(&y_rest)).expect("determined");
            (y[row] - fit.coefficients[0] - fit.coefficients[1] * x[row]).powi(2)
        };
        let expected: f64 = (0..5).map(without).sum();
        assert!((fit.left_out(&design(&x)) - expected).abs() < 1e-9 * expected, "{expected}");
    }

    #[test]
    fn instruments_undo_the_noise_of_a_regressor() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let rows = 20_000;
        let truth = DVector::from_fn(rows, |row, _| row as f64 / rows as f64);
        let noisy =
            DMatrix::from_fn(
                rows,
                2,
                |row, column| {
                    if column == 0 { 1.0 } else { truth[row] + 0.3 * noise(&mut random) }
                },
            );
        let clean = DMatrix::from_fn(rows, 2, |row, column| if column == 0 { 1.0 } else { truth[row] });
        let y = DVector::from_fn(rows, |row, _| 5.0 * truth[row] + 0.1 * noise(&mut random));
        let attenuated = least_squares(&noisy, &y).unwrap();
        let corrected = instrumental(noisy.as_view(), clean.as_view(), &y).unwrap();
        assert!(attenuated.coefficients[1] < 3.0, "the noise hides half of the slope");
        let error = (corrected.coefficients[1] - 5.0).abs();
        assert!(error < 3.0 * corrected.standard_error(1), "{error} against {}", corrected.standard_error(1));
        assert!(corrected.standard_error(1) < 0.1);
    }

    #[test]
    fn columns_that_say_the_same_are_refused() {
        let design = DMatrix::from_fn(50, 2, |row, column| row as f64 * (column + 1) as f64);
        assert!(least_squares(&design, &DVector::from_element(50, 1.0)).is_none());
        assert!(least_squares(&DMatrix::zeros(50, 1), &DVector::from_element(50, 1.0)).is_none());
        assert!(least_squares(&DMatrix::from_element(2, 1, 1.0), &DVector::from_element(2, 1.0)).is_none());
    }
}
