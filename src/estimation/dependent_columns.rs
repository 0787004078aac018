//! Least squares where columns may say the same: which of them carries what is left open, and what they leave does not hang on it.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Share of a column's size that is added to it in squares: far above rounding, far below what shows.
const ADDED: f64 = 1e-9;

/// Rows of a design, one behind the other.
pub(crate) struct DesignRows {
    columns: usize,
    values: Vec<f64>,
}

impl DesignRows {
    /// Empty, of so many `columns`, and with space for so many `rows`.
    pub fn new(columns: usize, rows: usize) -> Self {
        Self { columns, values: Vec::with_capacity(columns * rows) }
    }

    /// One more row.
    pub fn push(&mut self, row: &[f64]) {
        debug_assert_eq!(row.len(), self.columns);
        self.values.extend_from_slice(row);
    }

    pub fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.columns..(row + 1) * self.columns]
    }

    /// What the columns make of a row with these coefficients.
    pub fn value(&self, row: usize, coefficients: &[f64]) -> f64 {
        self.row(row).iter().zip(coefficients).map(|(value, factor)| value * factor).sum()
    }

    /// Coefficients of `y` on the columns over `kept` rows; `None` of too few, or of what is no number.
    pub fn coefficients(&self, y: &[f64], kept: &[usize]) -> Option<Vec<f64>> {
        let count = self.columns;
        if kept.len() <= count {
            return None;
        }
        let (mut squares, mut with) = (vec![0.0; count * count], vec![0.0; count]);
        for at in kept {
            let row = self.row(*at);
            for (column, value) in row.iter().enumerate() {
                with[column] += value * y[*at];
                // The other half is the same.
                let sums = &mut squares[column * count..column * count + column + 1];
                sums.iter_mut().zip(row).for_each(|(sum, other)| *sum += value * other);
            }
        }
        // A column of zeros carries nothing, in whatever size.
        let size = |column: usize| match squares[column * (count + 1)].sqrt() {
            0.0 => 1.0,
            size => size,
        };
        let sizes: Vec<f64> = (0..count).map(size).collect();
        let scaled = DMatrix::from_fn(count, count, |row, column| {
            let (low, high) = (row.min(column), row.max(column));
            squares[high * count + low] / (sizes[low] * sizes[high]) + if row == column { ADDED } else { 0.0 }
        });
        let with = DVector::from_fn(count, |column, _| with[column] / sizes[column]);
        let fitted = Cholesky::new(scaled)?.solve(&with);
        let fitted: Vec<f64> = fitted.iter().zip(&sizes).map(|(value, size)| value / size).collect();
        fitted.iter().all(|value| value.is_finite()).then_some(fitted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_say_the_same_leave_what_one_of_them_leaves() {
        let x = |row: usize| (row * 37 % 101) as f64;
        let mut design = DesignRows::new(4, 200);
        (0..200).for_each(|row| design.push(&[1.0, x(row), 2.0 * x(row) + 3.0, 0.0]));
        let y: Vec<f64> = (0..200).map(|row| 5.0 - 0.7 * x(row) + (row % 2) as f64).collect();
        let all: Vec<usize> = (0..200).collect();
        let fit = design.coefficients(&y, &all).expect("fits");
        let left = all.iter().map(|row| (y[*row] - design.value(*row, &fit)).powi(2)).sum::<f64>();
        assert!((left / 200.0).sqrt() < 0.51, "{left}");
        assert!(design.coefficients(&y, &all[..3]).is_none());
        // Rows that are not kept say nothing.
        let mut wrong = y.clone();
        wrong[7] = 1e6;
        let kept: Vec<usize> = (0..200).filter(|row| *row != 7).collect();
        let part = design.coefficients(&wrong, &kept).expect("fits");
        assert!((design.value(50, &part) - design.value(50, &fit)).abs() < 0.02, "{part:?} {fit:?}");
    }
}
