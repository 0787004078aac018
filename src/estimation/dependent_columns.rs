//! Least squares where columns may say the same: which of them carries what is left open, and what they leave does not hang on it.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Share of a column's size that is added to it in squares: far above rounding, far below what shows.
const ADDED: f64 = 1e-9;

/// Coefficients of `y` on the columns of `design`; `None` of too few rows, or of what is no number.
pub(crate) fn coefficients(design: &DMatrix<f64>, y: &DVector<f64>) -> Option<DVector<f64>> {
    if design.nrows() <= design.ncols() {
        return None;
    }
    let size = |column: usize| design.column(column).norm().max(f64::MIN_POSITIVE);
    let sizes = DVector::from_fn(design.ncols(), |column, _| size(column));
    let mut scaled = design.clone();
    scaled.column_iter_mut().zip(&sizes).for_each(|(mut column, size)| column /= *size);
    let mut squares = scaled.tr_mul(&scaled);
    (0..squares.nrows()).for_each(|at| squares[(at, at)] += ADDED);
    let fitted = Cholesky::new(squares)?.solve(&scaled.tr_mul(y)).component_div(&sizes);
    fitted.iter().all(|value| value.is_finite()).then_some(fitted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_say_the_same_leave_what_one_of_them_leaves() {
        let x = |row: usize| (row * 37 % 101) as f64;
        let design = DMatrix::from_fn(200, 3, |row, column| [1.0, x(row), 2.0 * x(row) + 3.0][column]);
        let y = DVector::from_fn(200, |row, _| 5.0 - 0.7 * x(row) + (row % 2) as f64);
        let left = &y - &design * coefficients(&design, &y).expect("fits");
        assert!(left.norm() / 200_f64.sqrt() < 0.51, "{}", left.norm());
        assert!(coefficients(&design.rows(0, 3).into_owned(), &y.rows(0, 3).into_owned()).is_none());
    }
}
