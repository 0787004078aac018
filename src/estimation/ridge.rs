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

    /// A row of weight one: two columns that are not zero, the first before the second, and all from column `from` on, which come
    /// behind both.
    pub fn add_dense<const N: usize>(
        &mut self,
        columns: [(usize, f64); 2],
        (from, dense): (usize, &[f64; N]),
        product: f64,
    ) {
        let rows = self.squares.nrows();
        // Of the symmetric matrix a solution takes the lower half; column by column, it lies in one piece.
        let squares = self.squares.as_mut_slice();
        let [first, second] = columns;
        squares[first.0 * rows + first.0] += first.1 * first.1;
        squares[first.0 * rows + second.0] += second.1 * first.1;
        squares[second.0 * rows + second.0] += second.1 * second.1;
        for (at, x) in columns {
            self.products[at] += x * product;
            let below = at * rows + from;
            squares[below..below + N].iter_mut().zip(dense).for_each(|(sum, y)| *sum += y * x);
        }
        for (index, x) in dense.iter().enumerate() {
            self.products[from + index] += x * product;
            let below = (from + index) * rows + from;
            // The few above the diagonal cost less than to leave them out.
            squares[below..below + N].iter_mut().zip(dense).for_each(|(sum, y)| *sum += y * x);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_with_a_dense_part_are_summed_as_any_others() {
        let (mut one, mut other) = (RidgeSums::new(5), RidgeSums::new(5));
        for row in 0..40 {
            let x = 0.1 * f64::from(row);
            let dense = [x.sin(), x * x, x.cos()];
            let columns = [(0, 1.0 - 0.2 * x), (1, 0.2 * x)];
            let all = columns.into_iter().chain((2..5).zip(dense));
            one.add(all, 1.0, 3.0 - x);
            other.add_dense(columns, (2, &dense), 3.0 - x);
        }
        assert_eq!(one.solve(40), other.solve(40));
    }
}
