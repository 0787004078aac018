//! Inverse of a normal matrix.

use super::thresholds::THRESHOLDS;
use nalgebra::DMatrix;

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
    if factor.l().diagonal().iter().any(|&pivot| pivot < THRESHOLDS.least_pivot) {
        return None;
    }
    let inverse = factor.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
        inverse[(row, column)] / (scale[row] * scale[column])
    }))
}
