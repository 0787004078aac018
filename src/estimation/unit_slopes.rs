//! Derivatives of the residuals of one short unit, and what is kept of them.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::fit_problem::UnitResiduals;
use super::normal_equations::sum_of_squares;

/// A unit to first order, its locals eliminated.
pub(super) struct UnitSlopes {
    /// Its part of the gradient, and of the normal matrix.
    pub score: DVector<f64>,
    pub hessian: DMatrix<f64>,
    /// The best locals less what they are, and what a move of each global asks for beside.
    change: DVector<f64>,
    by_globals: DMatrix<f64>,
}

impl UnitSlopes {
    /// Of the rows `unit` of residuals and their derivatives.
    pub fn of(
        unit: &Range<usize>,
        residuals: &[f64],
        columns: &[Vec<f64>],
        local_columns: &[Vec<f64>],
    ) -> Self {
        let size = columns.len();
        let own = |column: &Vec<f64>| column[unit.clone()].to_vec();
        // The last one is the residuals.
        let mut bare: Vec<Vec<f64>> = columns.iter().map(own).collect();
        bare.push(residuals[unit.clone()].to_vec());
        let locals: Vec<&[f64]> = local_columns.iter().map(|column| &column[unit.clone()]).collect();
        let taken = nearest(&locals, &bare);
        for (column, shares) in bare.iter_mut().zip(taken.column_iter()) {
            for (local, share) in locals.iter().zip(shares.iter()).filter(|(_, share)| **share != 0.0) {
                column.iter_mut().zip(*local).for_each(|(value, slope)| *value -= share * slope);
            }
        }
        let left = &bare[size];
        let mut hessian = DMatrix::zeros(size, size);
        for row in 0..size {
            for column in 0..=row {
                let sum = dot(&bare[row], &bare[column]);
                (hessian[(row, column)], hessian[(column, row)]) = (sum, sum);
            }
        }
        Self {
            score: DVector::from_fn(size, |index, _| dot(&bare[index], left)),
            hessian,
            change: -taken.column(size),
            by_globals: -taken.columns(0, size),
        }
    }

    /// By what the locals move to their best when the globals move so.
    pub fn local_change(&self, globals: &DVector<f64>) -> Vec<f64> {
        (&self.change + &self.by_globals * globals).iter().copied().collect()
    }
}

/// One step of the locals of some units to their best; each unit takes it where its own cost falls. `steps` are those of the difference
/// quotients. Whether another step may lower the cost by more than a share of `tolerance`.
pub(super) fn local_step(
    (at, block, units): (&dyn UnitResiduals, &Range<usize>, &[Range<usize>]),
    (steps, tolerance): (&[f64], f64),
    locals: &mut [f64],
    residuals: &mut [f64],
) -> bool {
    let count = steps.len();
    let columns: Vec<Vec<f64>> = (0..count)
        .map(|index| {
            let mut column = vec![0.0; residuals.len()];
            at.write(block.clone(), &moved_local(locals, index, steps), &mut column);
            quotients(&mut column, residuals, steps[index]);
            column
        })
        .collect();
    let (mut next, mut predicted) = (locals.to_vec(), vec![0.0; units.len()]);
    for ((unit, own), predicted) in units.iter().zip(next.chunks_mut(count)).zip(&mut predicted) {
        let columns: Vec<&[f64]> = columns.iter().map(|column| &column[unit.clone()]).collect();
        let left = &residuals[unit.clone()];
        let shares = nearest(&columns, &[left.to_vec()]);
        for ((local, share), column) in own.iter_mut().zip(shares.iter()).zip(&columns) {
            *local -= share;
            *predicted += share * dot(column, left);
        }
    }
    let before = sum_of_squares(residuals);
    // Not a number is no gain either.
    let all: f64 = predicted.iter().sum();
    if all.partial_cmp(&(tolerance * before)) != Some(std::cmp::Ordering::Greater) {
        return false;
    }
    let mut moved = vec![0.0; residuals.len()];
    at.write(block.clone(), &next, &mut moved);
    // Unit by unit: what one gains beyond what was predicted does not make up for what another lacks.
    let (mut fall, mut unforeseen) = (0.0, 0.0);
    for (index, (unit, predicted)) in units.iter().zip(&predicted).enumerate() {
        let gained = sum_of_squares(&residuals[unit.clone()]) - sum_of_squares(&moved[unit.clone()]);
        unforeseen += (gained - predicted).abs();
        if gained > 0.0 {
            fall += gained;
            residuals[unit.clone()].copy_from_slice(&moved[unit.clone()]);
            let own = index * count..(index + 1) * count;
            locals[own.clone()].copy_from_slice(&next[own]);
        }
    }
    f64::min(fall, unforeseen) > tolerance * before
}

/// Locals of some units, the one of this index of each moved by its step.
pub(super) fn moved_local(locals: &[f64], index: usize, steps: &[f64]) -> Vec<f64> {
    let mut moved = locals.to_vec();
    moved.iter_mut().skip(index).step_by(steps.len().max(1)).for_each(|local| *local += steps[index]);
    moved
}

/// Makes difference quotients of residuals that a step moved.
pub(super) fn quotients(moved: &mut [f64], residuals: &[f64], step: f64) {
    for (moved, at) in moved.iter_mut().zip(residuals) {
        let slope = (*moved - at) / step;
        *moved = if slope.is_finite() { slope } else { 0.0 };
    }
}

/// The shares of local columns that come nearest to each of some targets.
fn nearest(columns: &[&[f64]], targets: &[Vec<f64>]) -> DMatrix<f64> {
    let count = columns.len();
    let mut gram = DMatrix::zeros(count, count);
    for row in 0..count {
        for column in 0..=row {
            let sum = dot(columns[row], columns[column]);
            (gram[(row, column)], gram[(column, row)]) = (sum, sum);
        }
        // A whiff of damping: a unit too short for its locals leaves them where they are.
        gram[(row, row)] = gram[(row, row)] * (1.0 + 1e-9) + f64::MIN_POSITIVE;
    }
    let right = DMatrix::from_fn(count, targets.len(), |row, target| dot(columns[row], &targets[target]));
    let shares = gram.cholesky().map(|cholesky| cholesky.solve(&right));
    let mut shares = shares.unwrap_or_else(|| DMatrix::zeros(count, targets.len()));
    shares.iter_mut().filter(|share| !share.is_finite()).for_each(|share| *share = 0.0);
    shares
}

/// The sum of the products, of four sums side by side: one has to wait for each addition.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (fours, rest) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = fours.remainder().iter().zip(rest.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 4];
    for (a, b) in fours.zip(rest) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums[0] + sums[1] + (sums[2] + sums[3]) + tail
}
