//! Normal equations of a fit, and what they say of its parameters' errors.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::fit_problem::Free;
use super::measured_rows::MeasuredRows;
use super::thresholds::THRESHOLDS;
use crate::threads::spread;

/// Derivatives of residuals, column by column.
#[derive(Debug, Clone, Default)]
pub struct Slopes {
    /// By the globals.
    pub(crate) columns: Vec<Vec<f64>>,
    /// By the locals.
    pub(crate) local_columns: Vec<Vec<f64>>,
    /// The globals at which those by the locals were taken.
    pub(crate) taken_at: Vec<f64>,
}

impl Slopes {
    /// With the globals held.
    #[must_use]
    pub fn of_locals(&self) -> Self {
        let columns = self.columns.iter().map(|column| vec![0.0; column.len()]).collect();
        Self { columns, ..self.clone() }
    }

    /// The slopes of the residuals that count here; `None` where they are laid out otherwise.
    pub(crate) fn counting(&self, residuals: &[f64], globals: usize, locals: usize) -> Option<Self> {
        let fits = |columns: &[Vec<f64>], count: usize| {
            columns.len() == count && columns.iter().all(|column| column.len() == residuals.len())
        };
        let counting = |column: &Vec<f64>| -> Vec<f64> {
            let pairs = column.iter().zip(residuals);
            pairs.map(|(slope, residual)| if *residual == 0.0 { 0.0 } else { *slope }).collect()
        };
        (fits(&self.columns, globals) && fits(&self.local_columns, locals)).then(|| Self {
            columns: self.columns.iter().map(counting).collect(),
            local_columns: self.local_columns.iter().map(counting).collect(),
            taken_at: self.taken_at.clone(),
        })
    }
}

/// Chunks of units that are worked on one after another of long residuals: all at once would take as much memory as the slopes.
const CHUNKS: usize = 8;

/// Damping that only keeps equations solvable whose rounding errors are as large as what they ask for.
const UNDAMPED: f64 = 1e-10;

/// Normal equations of the globals, the locals eliminated.
pub(crate) struct Normal {
    pub(crate) hessian: DMatrix<f64>,
    pub(crate) gradient: DVector<f64>,
    pub(crate) slopes: Slopes,
}

impl Normal {
    /// The normal equations at these residuals.
    pub(crate) fn of(slopes: Slopes, residuals: &[f64], units: &[Range<usize>]) -> Self {
        let size = slopes.columns.len();
        // The upper triangle mirrors the lower one; the last row is the gradient's.
        let pairs: Vec<(usize, usize)> =
            (0..=size).flat_map(|row| (0..size.min(row + 1)).map(move |column| (row, column))).collect();
        let mut sums: Vec<f64> = vec![-0.0; pairs.len()];
        let columns: Vec<&[f64]> =
            slopes.columns.iter().map(Vec::as_slice).chain(std::iter::once(residuals)).collect();
        for units in chunks(units, residuals.len()).filter(|_| size > 0) {
            let bare = bare(&columns, &slopes.local_columns, units);
            // Each sum goes on where it was, as if there were one chunk.
            let going_on: Vec<(&(usize, usize), f64)> = pairs.iter().zip(sums).collect();
            sums = over(residuals.len(), &going_on, |((row, column), sum)| {
                bare[*row].iter().zip(&bare[*column]).fold(*sum, |sum, (a, b)| sum + a * b)
            });
        }
        let mut found = DMatrix::zeros(size + 1, size);
        pairs.iter().zip(sums).for_each(|(at, sum)| found[*at] = sum);
        let hessian = DMatrix::from_fn(size, size, |row, column| found[(row.max(column), row.min(column))]);
        let gradient = DVector::from_fn(size, |column, _| found[(size, column)]);
        Self { hessian, gradient, slopes }
    }

    /// The slopes behind a step by `globals` and `locals`, residuals `before` and `now`, with what it has shown of the globals'
    /// (Broyden): along it they are right, across it they are what they were.
    pub(crate) fn updated(
        self,
        (globals, locals): (&[f64], &[f64]),
        (before, now): (&[f64], &[f64]),
        units: &[Range<usize>],
    ) -> Slopes {
        let mut slopes = self.slopes;
        let moved = now.iter().zip(before);
        let mut unpredicted: Vec<f64> = moved.map(|(now, before)| now - before).collect();
        for (column, change) in slopes.columns.iter().zip(globals).filter(|(_, change)| **change != 0.0) {
            unpredicted.iter_mut().zip(column).for_each(|(left, slope)| *left -= change * slope);
        }
        let count = slopes.local_columns.len();
        for (unit, changes) in units.iter().zip(locals.chunks(count.max(1))) {
            for (column, change) in slopes.local_columns.iter().zip(changes) {
                let pairs = unpredicted[unit.clone()].iter_mut().zip(&column[unit.clone()]);
                pairs.for_each(|(left, slope)| *left -= change * slope);
            }
        }
        let weight = |index: usize| globals[index] * self.hessian[(index, index)];
        let length: f64 = (0..globals.len()).map(|index| globals[index] * weight(index)).sum();
        for (index, column) in slopes.columns.iter_mut().enumerate() {
            let share = weight(index) / length;
            if share != 0.0 && share.is_finite() {
                column.iter_mut().zip(&unpredicted).for_each(|(slope, left)| *slope += share * left);
            }
        }
        slopes
    }

    /// By what the cost should fall when the globals move so, the locals following.
    pub(crate) fn predicted_fall(&self, change: &[f64]) -> f64 {
        let change = DVector::from_column_slice(change);
        -(2.0 * self.gradient.dot(&change) + (&self.hessian * &change).dot(&change))
    }

    /// By what the cost may still fall behind a step by `change` to `globals`, as far as the slopes hold: more than a little where a bound
    /// cut the step short, or damping did in a direction that the others nearly span.
    pub(crate) fn left_to_fall(&self, change: &[f64], free: &[Free], globals: &[f64]) -> f64 {
        let gradient = &self.gradient + &self.hessian * DVector::from_column_slice(change);
        let rest = Self { hessian: self.hessian.clone(), gradient, slopes: Slopes::default() };
        rest.predicted_fall(&rest.direction(free, globals, UNDAMPED))
    }

    /// The damped Gauss-Newton step from `globals`; parameters that stand at a bound and push against it stay.
    pub(crate) fn direction(&self, free: &[Free], globals: &[f64], damping: f64) -> Vec<f64> {
        let size = globals.len();
        let moves: Vec<usize> = (0..size)
            .filter(|index| {
                let (free, value) = (&free[*index], globals[*index]);
                let down = self.gradient[*index] > 0.0;
                let at_bound = (down && value <= free.bounds.0) || (!down && value >= free.bounds.1);
                !at_bound && self.hessian[(*index, *index)] > 0.0
            })
            .collect();
        let mut change = vec![0.0; size];
        let scale: Vec<f64> = moves.iter().map(|index| self.hessian[(*index, *index)].sqrt()).collect();
        let matrix = DMatrix::from_fn(moves.len(), moves.len(), |row, column| {
            let value = self.hessian[(moves[row], moves[column])] / (scale[row] * scale[column]);
            if row == column { value + damping } else { value }
        });
        let right = DVector::from_fn(moves.len(), |row, _| -self.gradient[moves[row]] / scale[row]);
        if let Some(cholesky) = matrix.cholesky() {
            let solution = cholesky.solve(&right);
            for (row, index) in moves.iter().enumerate() {
                change[*index] = solution[row] / scale[row];
            }
        }
        change
    }

    /// Whether any global moves the residuals.
    pub(crate) fn leads_on(&self) -> bool {
        (0..self.gradient.len()).any(|index| self.hessian[(index, index)] > 0.0)
    }
}

/// Units in chunks, those of short residuals in one.
fn chunks(units: &[Range<usize>], len: usize) -> impl Iterator<Item = &[Range<usize>]> {
    let count = if len < THRESHOLDS.parallel_residuals { 1 } else { CHUNKS };
    units.chunks(units.len().div_ceil(count).max(1))
}

/// What `work` makes of each item, of long residuals on as many threads as there are.
fn over<T: Sync, R: Send>(len: usize, items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    if len < THRESHOLDS.parallel_residuals { items.iter().map(work).collect() } else { spread(items, work) }
}

/// The rows of some units, which follow each other, of columns without what the locals take up, unit by unit.
fn bare(columns: &[&[f64]], local_columns: &[Vec<f64>], units: &[Range<usize>]) -> Vec<Vec<f64>> {
    let (Some(first), Some(last)) = (units.first(), units.last()) else {
        return vec![Vec::new(); columns.len()];
    };
    let (start, len) = (first.start, columns.first().map_or(0, |column| column.len()));
    let bases = over(len, units, |unit| orthonormal(local_columns, unit));
    over(len, columns, |column| {
        let mut part = column[start..last.end].to_vec();
        for (unit, basis) in units.iter().zip(&bases) {
            remove(basis, &mut part[unit.start - start..unit.end - start]);
        }
        part
    })
}

/// The sum of the squares; the greatest number there is where that is none.
#[must_use]
pub fn sum_of_squares(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|value| value * value).sum();
    // A simulation that ran away must lose against any that did not.
    if sum.is_finite() { sum } else { f64::MAX }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Sums side by side: each addition of a single one would wait for the one before.
    let mut sums = [0.0; 4];
    let (whole, rest) = a.as_chunks::<4>();
    let (other, other_rest) = b.as_chunks::<4>();
    for (a, b) in whole.iter().zip(other) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f64 = rest.iter().zip(other_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// An orthonormal basis of the columns over a unit (Gram-Schmidt; once more takes away what rounding left).
pub(crate) fn orthonormal(columns: &[Vec<f64>], unit: &Range<usize>) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    for column in columns {
        let mut part = column[unit.clone()].to_vec();
        let before = dot(&part, &part);
        remove(&basis, &mut part);
        remove(&basis, &mut part);
        let length = dot(&part, &part);
        // A column that the others already span carries nothing.
        if length > 1e-12 * before && length > 0.0 {
            let scale = length.sqrt().recip();
            part.iter_mut().for_each(|value| *value *= scale);
            basis.push(part);
        }
    }
    basis
}

/// Takes away what the basis spans.
pub(crate) fn remove(basis: &[Vec<f64>], part: &mut [f64]) {
    for direction in basis {
        let share = dot(direction, part);
        part.iter_mut().zip(direction).for_each(|(value, unit)| *value -= share * unit);
    }
}

/// The coefficients of the local columns that come nearest to `target` over a unit.
pub(crate) fn least_squares(columns: &[Vec<f64>], unit: &Range<usize>, target: &[f64]) -> Vec<f64> {
    let count = columns.len();
    let part = |index: usize| &columns[index][unit.clone()];
    let matrix = DMatrix::from_fn(count, count, |row, column| {
        let value = dot(part(row), part(column));
        // A whiff of damping: a unit too short for its locals leaves them where they are.
        if row == column { value * (1.0 + 1e-9) + f64::MIN_POSITIVE } else { value }
    });
    let right = DVector::from_fn(count, |row, _| dot(part(row), &target[unit.clone()]));
    match matrix.cholesky() {
        Some(cholesky) => {
            cholesky.solve(&right).iter().map(|value| if value.is_finite() { *value } else { 0.0 }).collect()
        }
        None => vec![0.0; count],
    }
}

/// The larger of two standard errors: from white noise of the residuals' own size, and from what clusters of
/// residuals say, which holds for correlated residuals too.
/// `residuals` are those of the rows that are kept, of a vector with `units` and this length.
pub(crate) fn standard_errors(
    normal: &Normal,
    residuals: &[f64],
    (units, len): (&[Range<usize>], usize),
    rows: Option<&MeasuredRows>,
) -> Vec<f64> {
    let locals = units.len() * normal.slopes.local_columns.len();
    errors_of(&normal.hessian, (residuals, locals), |live, scale| {
        let mut meat = DMatrix::zeros(live.len(), live.len());
        let columns: Vec<&[f64]> =
            live.iter().map(|index| normal.slopes.columns[*index].as_slice()).collect();
        let kept = rows.map_or(units, MeasuredRows::units);
        for (units, kept) in chunks(units, residuals.len()).zip(chunks(kept, residuals.len())) {
            let bare = bare(&columns, &normal.slopes.local_columns, kept);
            let start = kept.first().map_or(0, |first| first.start);
            for cluster in clusters(units, len) {
                let cluster = rows.map_or(cluster.clone(), |rows| rows.within(&cluster));
                let score = DVector::from_fn(live.len(), |row, _| {
                    let within = cluster.start - start..cluster.end - start;
                    dot(&bare[row][within], &residuals[cluster.clone()]) / scale[row]
                });
                meat += &score * score.transpose();
            }
        }
        meat
    })
}

/// The same from the normal matrix, the residuals with the number of `locals` fitted to them, and the sum of the squared scores of
/// clusters, by those parameters that move the residuals, each over its scale.
pub(crate) fn errors_of(
    hessian: &DMatrix<f64>,
    (residuals, locals): (&[f64], usize),
    squared_scores: impl FnOnce(&[usize], &[f64]) -> DMatrix<f64>,
) -> Vec<f64> {
    let size = hessian.nrows();
    let live: Vec<usize> = (0..size).filter(|index| hessian[(*index, *index)] > 0.0).collect();
    let mut errors = vec![f64::INFINITY; size];
    let scale: Vec<f64> = live.iter().map(|index| hessian[(*index, *index)].sqrt()).collect();
    let matrix = DMatrix::from_fn(live.len(), live.len(), |row, column| {
        hessian[(live[row], live[column])] / (scale[row] * scale[column])
    });
    let Some(inverse) = matrix.cholesky().map(|cholesky| cholesky.inverse()) else { return errors };
    let used = residuals.iter().filter(|value| **value != 0.0).count();
    let variance = sum_of_squares(residuals) / used.saturating_sub(live.len() + locals).max(1) as f64;
    let robust = &inverse * squared_scores(&live, &scale) * &inverse;
    for (row, index) in live.iter().enumerate() {
        errors[*index] =
            (variance * inverse[(row, row)]).max(robust[(row, row)]).max(0.0).sqrt() / scale[row];
    }
    errors
}

/// Clusters of residuals that are as good as independent: units, or pieces of long ones.
fn clusters(units: &[Range<usize>], len: usize) -> Vec<Range<usize>> {
    let longest = longest_cluster(len);
    let cut = |unit: &Range<usize>| {
        let end = unit.end;
        unit.clone().step_by(longest).map(move |from| from..(from + longest).min(end))
    };
    units.iter().flat_map(cut).collect()
}

/// Of residuals of this length.
pub(crate) fn longest_cluster(len: usize) -> usize {
    (len / THRESHOLDS.clusters).max(1)
}
