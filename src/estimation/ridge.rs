//! Least squares by normal equations with a ridge: of rows with few columns that are not zero, and of whole columns.

use nalgebra::{DMatrix, DVector};

use super::normal_equations::dot;
use super::thresholds::THRESHOLDS;

/// Share of the rows that is added to each column's own.
pub(crate) const RIDGE: f64 = THRESHOLDS.ridge;

/// The same where none is asked for: what two columns that say the same need to be solved at all.
const LEAST_RIDGE: f64 = 1e-9;

/// Normal equations.
pub(crate) struct RidgeSums {
    squares: DMatrix<f64>,
    products: DVector<f64>,
}

impl RidgeSums {
    pub fn new(count: usize) -> Self {
        Self { squares: DMatrix::zeros(count, count), products: DVector::zeros(count) }
    }

    /// The sums of these rows and of others.
    pub fn and(mut self, others: &Self) -> Self {
        self.squares += &others.squares;
        self.products += &others.products;
        self
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

/// The step along each column of slopes that lowers the squares of the residuals most, and its variance at residuals of size one:
/// infinite where a column is zero. From column `from` on there is a ridge, as a share of the largest of those columns' squares.
pub(crate) fn ridge_step(
    columns: &[&[f64]],
    from: usize,
    residuals: &[f64],
    ridge: f64,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let squares: Vec<f64> = columns.iter().map(|column| dot(column, column)).collect();
    let most = squares.iter().skip(from).copied().fold(0.0, f64::max);
    let live: Vec<usize> = (0..columns.len()).filter(|index| squares[*index] > 0.0).collect();
    let scale: Vec<f64> = live.iter().map(|index| squares[*index].sqrt()).collect();
    // A factorization takes the lower half.
    let matrix = DMatrix::from_fn(live.len(), live.len(), |row, column| {
        if row < column {
            return 0.0;
        }
        let product = dot(columns[live[row]], columns[live[column]]) / (scale[row] * scale[column]);
        let damping = if live[row] >= from { ridge * most / squares[live[row]] } else { 0.0 };
        if row == column { product + damping + LEAST_RIDGE } else { product }
    });
    let right = DVector::from_fn(live.len(), |row, _| -dot(columns[live[row]], residuals) / scale[row]);
    let factor = matrix.cholesky()?;
    let solution = factor.solve(&right);
    let inverse = factor.inverse();
    let (mut step, mut variances) = (vec![0.0; columns.len()], vec![f64::INFINITY; columns.len()]);
    for (row, index) in live.iter().enumerate() {
        step[*index] = solution[row] / scale[row];
        variances[*index] = inverse[(row, row)] / scale[row].powi(2);
    }
    Some((step, variances))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns at right angles: the first, however large, as least squares says; the second halved by a ridge of its own size.
    #[test]
    fn a_ridge_holds_back_the_columns_that_it_is_for() {
        let columns: [&[f64]; 3] = [&[3.0, 3.0, 0.0], &[0.0, 0.0, 2.0], &[0.0; 3]];
        let (step, variances) = ridge_step(&columns, 1, &[-3.0, -3.0, -4.0], 1.0).expect("solved");
        // The least ridge moves the ninth digit.
        let near = |a: f64, b: f64| (a - b).abs() < 1e-7;
        assert!(near(step[0], 1.0) && near(step[1], 1.0) && step[2] == 0.0, "{step:?}");
        assert!(near(variances[0], 1.0 / 18.0) && near(variances[1], 0.125) && variances[2].is_infinite());
    }

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
