//! Standard errors that hold where residuals are correlated: the sandwich of scores summed over blocks of time.

use nalgebra::{DMatrix, DVector};

use super::thresholds::THRESHOLDS;

/// Blocks of `rows` samples in order of time.
pub(crate) fn blocks(rows: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let count = (rows / THRESHOLDS.shortest_block).clamp(1, THRESHOLDS.most_blocks);
    (0..count).map(move |block| block * rows / count..(block + 1) * rows / count)
}

/// [-] What a standard error of so few degrees of freedom is stretched by, so that ±1.96 of it reach as far as Student's quantile:
/// 1.96 (1 + (1.96² + 1) / (4 ν) + ...).
pub(crate) fn stretched(freedom: f64) -> f64 {
    1.0 + 1.21 / freedom
}

/// `white`, with each coefficient's row and column stretched where the sandwich of block scores says that its
/// standard error is larger. `inverse` is the inverse of the normal matrix; `scores` are the sums over the
/// [`blocks`] of `rows` samples, whose residual has this [`memory`](super::autocorrelation::memory).
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
    // variance from few blocks is itself uncertain.
    let factor = blocks as f64 / freedom * stretched(freedom).powi(2) / kept_in(rows / blocks, memory);
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
    let (length, rho) = (length.max(1) as f64, memory.clamp(0.0, THRESHOLDS.strongest_memory));
    let lost = 2.0 * rho * (1.0 - rho.powf(length)) / (length * (1.0 - rho * rho));
    (1.0 - lost).max(THRESHOLDS.least_seen_variance)
}

/// Neighbouring blocks put together until each is long against the correlation.
fn merged(scores: &[DVector<f64>], rows: usize, memory: f64) -> Vec<DVector<f64>> {
    let length = (rows / scores.len().max(1)).max(1) as f64;
    let wanted = THRESHOLDS.block_correlation_times / (1.0 - memory).max(1e-3);
    let together =
        ((wanted / length).ceil() as usize).clamp(1, (scores.len() / THRESHOLDS.fewest_blocks).max(1));
    scores.chunks(together).map(|group| group.iter().sum()).collect()
}
