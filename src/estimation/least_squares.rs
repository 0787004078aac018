//! Linear least squares and instrumental variables, with standard errors that allow for correlated residuals.

use nalgebra::{DMatrix, DVector};

/// Blocks over which correlated scores are summed: enough to estimate a variance, long enough to hold the
/// correlation of slow residuals.
const MOST_BLOCKS: usize = 60;
/// Fewest samples in a block.
const SHORTEST_BLOCK: usize = 10;
/// A block should be this many correlation times long: what neighbours share is then a tenth of their variance.
const CORRELATION_TIMES: f64 = 8.0;
/// ... but fewer blocks than these say little about a variance.
const FEWEST_BLOCKS: usize = 20;

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

/// Least squares of `y` on the columns of `design`; `None` when the columns do not determine the coefficients.
pub(crate) fn least_squares(design: &DMatrix<f64>, y: &DVector<f64>) -> Option<LinearFit> {
    instrumental(design, design, y)
}

/// Two-stage least squares: the columns of `design` may carry measurement noise, those of `instruments` must
/// not share it. With `instruments` = `design` it is ordinary least squares.
///
/// The covariance is that of white residuals, widened for each coefficient by the one from sums of scores
/// over blocks of time where that is larger, so that intervals hold with correlated residuals.
pub(crate) fn instrumental(
    design: &DMatrix<f64>,
    instruments: &DMatrix<f64>,
    y: &DVector<f64>,
) -> Option<LinearFit> {
    let (rows, columns) = design.shape();
    if rows <= columns + 1 {
        return None;
    }
    let first_stage = invert(&(instruments.transpose() * instruments))? * (instruments.transpose() * design);
    let fitted = instruments * first_stage;
    let inverse = invert(&(fitted.transpose() * &fitted))?;
    let coefficients = &inverse * (fitted.transpose() * y);
    let residuals = y - design * &coefficients;
    let variance = residuals.norm_squared() / (rows - columns) as f64;
    let white = &inverse * variance;
    let scores = |block: std::ops::Range<usize>| {
        block.fold(DVector::zeros(columns), |sum, row| sum + fitted.row(row).transpose() * residuals[row])
    };
    let covariance =
        widened(&white, &inverse, &block_scores(rows, scores), rows, memory(residuals.as_slice()));
    let residual_rms = (residuals.norm_squared() / rows as f64).sqrt();
    Some(LinearFit { coefficients, covariance, residual_rms, residuals })
}

/// Blocks of `rows` samples in order of time.
pub(crate) fn blocks(rows: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let count = (rows / SHORTEST_BLOCK).clamp(1, MOST_BLOCKS);
    (0..count).map(move |block| block * rows / count..(block + 1) * rows / count)
}

fn block_scores(rows: usize, scores: impl Fn(std::ops::Range<usize>) -> DVector<f64>) -> Vec<DVector<f64>> {
    blocks(rows).map(scores).collect()
}

/// `white`, with each coefficient's row and column stretched where the sandwich of block scores says that its
/// standard error is larger. `inverse` is the inverse of the normal matrix; `scores` are the sums over the
/// [`blocks`] of `rows` samples, whose residual has this [`memory`].
pub(crate) fn widened(
    white: &DMatrix<f64>,
    inverse: &DMatrix<f64>,
    scores: &[DVector<f64>],
    rows: usize,
    memory: f64,
) -> DMatrix<f64> {
    let columns = white.nrows();
    let scores = merged(scores, rows, memory);
    let blocks = scores.len();
    if blocks < columns + 3 {
        return white.clone();
    }
    let meat =
        scores.iter().fold(DMatrix::zeros(columns, columns), |sum, score| sum + score * score.transpose());
    let freedom = (blocks - columns) as f64;
    // Small-sample factor of cluster-robust variances: scores are orthogonal to the fitted coefficients. And a
    // variance from few blocks is itself uncertain: ±1.96 standard errors must reach as far as Student's quantile,
    // 1.96 (1 + (1.96² + 1) / (4 ν) + ...).
    let factor = blocks as f64 / freedom * (1.0 + 1.21 / freedom).powi(2) / kept_in(rows / blocks, memory);
    let sandwich = inverse * meat * inverse * factor;
    let stretch = DVector::from_fn(columns, |index, _| {
        let ratio = sandwich[(index, index)] / white[(index, index)];
        if ratio.is_finite() { ratio.max(1.0).sqrt() } else { 1.0 }
    });
    DMatrix::from_fn(columns, columns, |row, column| white[(row, column)] * stretch[row] * stretch[column])
}

/// Share of the variance of a sum that blocks of `length` rows see when the correlation falls by the factor `memory`
/// from row to row: what reaches over the edges is lost.
fn kept_in(length: usize, memory: f64) -> f64 {
    let (length, rho) = (length.max(1) as f64, memory.clamp(0.0, 0.98));
    let lost = 2.0 * rho * (1.0 - rho.powf(length)) / (length * (1.0 - rho * rho));
    (1.0 - lost).max(0.25)
}

/// Neighbouring blocks put together until each is long against the correlation.
fn merged(scores: &[DVector<f64>], rows: usize, memory: f64) -> Vec<DVector<f64>> {
    let length = (rows / scores.len().max(1)).max(1) as f64;
    let wanted = CORRELATION_TIMES / (1.0 - memory).max(1e-3);
    let together = ((wanted / length).ceil() as usize).clamp(1, (scores.len() / FEWEST_BLOCKS).max(1));
    scores.chunks(together).map(|group| group.iter().sum()).collect()
}

/// Inverse of a symmetric positive matrix, scaled first; `None` when it is singular to working precision.
pub(crate) fn invert(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|entry| if entry > 0.0 { entry.sqrt() } else { 0.0 });
    if scale.iter().any(|&entry| entry == 0.0 || !entry.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
        matrix[(row, column)] / (scale[row] * scale[column])
    });
    let factor = scaled.cholesky()?;
    // Of a correlation matrix: a tiny pivot is a column that the others already say.
    if factor.l().diagonal().iter().any(|&pivot| pivot < 1e-6) {
        return None;
    }
    let inverse = factor.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
        inverse[(row, column)] / (scale[row] * scale[column])
    }))
}

/// Lag-one correlation of a residual; 0 when it has no variance.
pub(crate) fn lag_one_correlation(residuals: &[f64]) -> f64 {
    correlation(residuals, 1)
}

fn correlation(residuals: &[f64], lag: usize) -> f64 {
    let products: f64 = residuals.iter().zip(residuals.iter().skip(lag)).map(|(a, b)| a * b).sum();
    let squares: f64 = residuals.iter().map(|value| value * value).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// Factor by which the correlation of a residual falls from row to row. Slow noise under white noise starts low and
/// falls slowly: that shows in the second lag against the first.
pub(crate) fn memory(residuals: &[f64]) -> f64 {
    let (first, second) = (correlation(residuals, 1), correlation(residuals, 2));
    // Four standard errors of a correlation that is not there.
    if first < 4.0 / (residuals.len() as f64).sqrt() { first } else { first.max(second / first).min(1.0) }
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
        let corrected = instrumental(&noisy, &clean, &y).unwrap();
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
