//! Normal equations of a fit, and what they say of its parameters' errors.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::measured_rows::MeasuredRows;
use super::thresholds::THRESHOLDS;
use crate::threads::{spread, spread_out};

/// Derivatives of residuals, column by column.
#[derive(Debug, Clone)]
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

/// Pieces into which the units of long residuals are put together.
const PIECES: usize = 64;

/// Normal equations of the globals, the locals eliminated.
pub(crate) struct Normal {
    pub(crate) hessian: DMatrix<f64>,
    pub(crate) gradient: DVector<f64>,
    pub(crate) slopes: Slopes,
    /// The globals' columns without what the locals take up.
    pub(crate) bare_columns: Vec<Vec<f64>>,
}

impl Normal {
    /// The normal equations at these residuals.
    pub(crate) fn of(slopes: Slopes, residuals: &[f64], units: &[Range<usize>]) -> Self {
        let (residuals, bare_columns) = bare(&slopes, residuals, units);
        let size = bare_columns.len();
        // The upper triangle mirrors the lower one.
        let pairs: Vec<(usize, usize)> =
            (0..size).flat_map(|row| (0..=row).map(move |column| (row, column))).collect();
        let product = |(row, column): &(usize, usize)| dot(&bare_columns[*row], &bare_columns[*column]);
        let products: Vec<f64> = if residuals.len() < THRESHOLDS.parallel_residuals {
            pairs.iter().map(product).collect()
        } else {
            spread(&pairs, product)
        };
        let mut hessian = DMatrix::zeros(size, size);
        pairs.iter().zip(products).for_each(|(at, product)| hessian[*at] = product);
        let hessian = DMatrix::from_fn(size, size, |row, column| hessian[(row.max(column), row.min(column))]);
        let gradient = DVector::from_fn(size, |row, _| dot(&bare_columns[row], &residuals));
        Self { hessian, gradient, slopes, bare_columns }
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

    /// Whether any global moves the residuals.
    pub(crate) fn leads_on(&self) -> bool {
        (0..self.gradient.len()).any(|index| self.hessian[(index, index)] > 0.0)
    }
}

/// A unit, and its part of each column.
type Unit<'a> = (Range<usize>, Vec<&'a mut [f64]>);

/// Residuals and the globals' columns without what the locals take up, unit by unit. Of long ones, pieces of units side by side:
/// units do not see each other.
fn bare(slopes: &Slopes, residuals: &[f64], units: &[Range<usize>]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (mut residuals, mut bare_columns) = (residuals.to_vec(), slopes.columns.clone());
    let remove_all = |unit: &Range<usize>, parts: &mut [&mut [f64]]| {
        let basis = orthonormal(&slopes.local_columns, unit);
        parts.iter_mut().for_each(|part| remove(&basis, part));
    };
    let mut left: Vec<&mut [f64]> =
        bare_columns.iter_mut().chain(std::iter::once(&mut residuals)).map(Vec::as_mut_slice).collect();
    let mut done = 0;
    let mut cut = |unit: &Range<usize>| {
        let from = std::mem::replace(&mut done, unit.end);
        let parts = left.iter_mut().filter_map(|column| {
            let (part, rest) = std::mem::take(column).split_at_mut_checked(unit.end - from)?;
            *column = rest;
            part.get_mut(unit.start - from..)
        });
        (unit.clone(), parts.collect::<Vec<&mut [f64]>>())
    };
    let of_units: Vec<Unit> = units.iter().map(&mut cut).collect();
    if slopes.local_columns.first().is_none_or(|column| column.len() < THRESHOLDS.parallel_residuals) {
        of_units.into_iter().for_each(|(unit, mut parts)| remove_all(&unit, &mut parts));
    } else {
        let mut pieces: Vec<Vec<Unit>> = Vec::new();
        let piece = units.len().div_ceil(PIECES);
        for (index, of_unit) in of_units.into_iter().enumerate() {
            if index.is_multiple_of(piece) {
                pieces.push(Vec::with_capacity(piece));
            }
            if let Some(last) = pieces.last_mut() {
                last.push(of_unit);
            }
        }
        spread_out(pieces, |units| {
            units.into_iter().for_each(|(unit, mut parts)| remove_all(&unit, &mut parts));
        });
    }
    (residuals, bare_columns)
}

/// The sum of the squares; the greatest number there is where that is none.
#[must_use]
pub fn sum_of_squares(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|value| value * value).sum();
    // A simulation that ran away must lose against any that did not.
    if sum.is_finite() { sum } else { f64::MAX }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// An orthonormal basis of the columns over a unit (Gram-Schmidt, twice is enough for two or three columns).
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
    let size = normal.slopes.columns.len();
    let live: Vec<usize> = (0..size).filter(|index| normal.hessian[(*index, *index)] > 0.0).collect();
    let mut errors = vec![f64::INFINITY; size];
    let scale: Vec<f64> = live.iter().map(|index| normal.hessian[(*index, *index)].sqrt()).collect();
    let matrix = DMatrix::from_fn(live.len(), live.len(), |row, column| {
        normal.hessian[(live[row], live[column])] / (scale[row] * scale[column])
    });
    let Some(inverse) = matrix.cholesky().map(|cholesky| cholesky.inverse()) else { return errors };
    let used = residuals.iter().filter(|value| **value != 0.0).count();
    let spent = live.len() + units.len() * normal.slopes.local_columns.len();
    let variance = sum_of_squares(residuals) / used.saturating_sub(spent).max(1) as f64;
    let mut meat = DMatrix::zeros(live.len(), live.len());
    for cluster in clusters(units, len) {
        let cluster = rows.map_or(cluster.clone(), |rows| rows.within(&cluster));
        let score = DVector::from_fn(live.len(), |row, _| {
            dot(&normal.bare_columns[live[row]][cluster.clone()], &residuals[cluster.clone()]) / scale[row]
        });
        meat += &score * score.transpose();
    }
    let robust = &inverse * meat * &inverse;
    for (row, index) in live.iter().enumerate() {
        errors[*index] =
            (variance * inverse[(row, row)]).max(robust[(row, row)]).max(0.0).sqrt() / scale[row];
    }
    errors
}

/// Clusters of residuals that are as good as independent: units, or pieces of long ones.
fn clusters(units: &[Range<usize>], len: usize) -> Vec<Range<usize>> {
    let longest = (len / THRESHOLDS.clusters).max(1);
    let cut = |unit: &Range<usize>| {
        let end = unit.end;
        unit.clone().step_by(longest).map(move |from| from..(from + longest).min(end))
    };
    units.iter().flat_map(cut).collect()
}
