//! Least squares by normal equations whose rows have few columns that are not zero, with a ridge.

use nalgebra::{DMatrix, DVector};

use super::thresholds::THRESHOLDS;

/// Share of the rows that is added to each column's own.
pub(crate) const RIDGE: f64 = THRESHOLDS.ridge;

/// Normal equations.
pub(crate) struct RidgeSums {
    squares: DMatrix<f64>,
    products: DVector<f64>,
}

impl RidgeSums {
    pub fn new(count: usize) -> Self {
        Self { squares: DMatrix::zeros(count, count), products: DVector::zeros(count) }
    }

    /// A row: its columns that are not zero, its weight, and its weighted value.
    pub fn add(&mut self, columns: impl Iterator<Item = (usize, f64)> + Clone, weight: f64, product: f64) {
        for (a, x) in columns.clone() {
            self.products[a] += x * product;
            columns.clone().for_each(|(b, y)| self.squares[(a, b)] += weight * x * y);
        }
    }

    /// The coefficients, of columns of the order of one; `None` where they are no numbers.
    pub fn solve(mut self, rows: usize) -> Option<DVector<f64>> {
        for at in 0..self.products.len() {
            self.squares[(at, at)] += RIDGE * rows as f64;
        }
        let solved = self.squares.cholesky()?.solve(&self.products);
        solved.iter().all(|value| value.is_finite()).then_some(solved)
    }
}
