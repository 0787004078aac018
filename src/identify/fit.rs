//! Output-error fitting: the parameters with which a free run comes nearest to what was measured.
//!
//! A problem has global parameters, and local ones (initial states) of each unit (a stretch of a log between
//! holes, a window). The local ones are eliminated unit by unit, so that a thousand windows cost no more than
//! their simulation. Gauss-Newton steps with Levenberg-Marquardt damping; derivatives by differences of the
//! same simulation that serves every other purpose.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

/// Most local parameters of a unit.
pub const MOST_LOCALS: usize = 3;

/// What can be fitted.
pub trait OutputError: Sync {
    /// Where each unit's residuals stand in the residual vector.
    fn units(&self) -> &[Range<usize>];
    /// Number of local parameters of each unit, at most [`MOST_LOCALS`].
    fn locals(&self) -> usize;
    /// Length of the residual vector.
    fn len(&self) -> usize;
    /// Whether there is no residual.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Writes measured minus simulated over its standard deviation; zero where nothing was measured.
    /// `locals` holds those of unit 0, then of unit 1, ...
    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]);
    /// The size of a change of a local parameter that shows: the step of its derivative.
    fn local_scale(&self, index: usize) -> f64;
}

/// A global parameter of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Free {
    /// Where the fit starts.
    pub start: f64,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// Its typical size, for the step of the derivative.
    pub scale: f64,
}

/// When a fit stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitConfig {
    /// Most accepted or refused steps.
    pub iterations: usize,
    /// It has converged when a step lowers the cost by less than this share.
    pub tolerance: f64,
    /// A fit that stays above this cost is for nothing, and is given up when it hardly falls any more.
    pub goal: Option<f64>,
}

impl Default for FitConfig {
    fn default() -> Self {
        Self { iterations: 40, tolerance: 1e-7, goal: None }
    }
}

/// What a fit found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Global parameters.
    pub globals: Vec<f64>,
    /// Local parameters, unit by unit.
    pub locals: Vec<f64>,
    /// Standard error of each global parameter; infinite where the data do not determine it.
    pub standard_errors: Vec<f64>,
    /// Sum of squares of the residuals.
    pub cost: f64,
    /// Residuals at the solution.
    pub residuals: Vec<f64>,
    /// Steps taken.
    pub iterations: usize,
}

/// Relative step of the difference quotients: half the digits of a double, rounded up for kinks in the laws.
const DERIVATIVE_STEP: f64 = 1e-6;
/// Damping at which a step is so short that no descent is left.
const MOST_DAMPING: f64 = 1e10;

/// Damping from which a step is much shorter than the one without.
const HELD_BACK: f64 = 1e-2;

/// A step that lowers the cost by a smaller share is slow, and so many of them in a row lead nowhere soon.
const SLOW: (f64, usize) = (2e-4, 3);

/// Normal equations of the globals, the locals eliminated.
struct Normal {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Derivatives by the globals, column by column.
    columns: Vec<Vec<f64>>,
    /// The same without what the locals take up.
    bare_columns: Vec<Vec<f64>>,
    /// Derivatives by the locals, column by column.
    local_columns: Vec<Vec<f64>>,
    /// The globals at which the locals' derivatives were taken.
    taken_at: Vec<f64>,
}

/// The locals' derivatives are taken anew when a global has moved by more than this share.
const MOVED: f64 = 0.05;

/// Fits a problem.
pub fn fit(problem: &dyn OutputError, free: &[Free], locals: Option<&[f64]>, config: &FitConfig) -> Fit {
    let mut search = Search::start(problem, free, locals);
    let mut damping = 1e-4;
    let mut iterations = 0;
    let mut known: Option<Normal> = None;
    let mut slow = 0;
    while iterations < config.iterations {
        let normal = search.normal(known.take());
        let mut fall = None;
        while damping < MOST_DAMPING && iterations < config.iterations {
            iterations += 1;
            fall = search.step(&normal, damping);
            if fall.is_some() {
                damping = (damping * 0.1).max(1e-12);
                break;
            }
            damping *= 10.0;
        }
        known = Some(normal);
        slow = if fall.is_some_and(|fall| fall > SLOW.0) { 0 } else { slow + 1 };
        if slow >= SLOW.1 && config.goal.is_some_and(|goal| search.cost > goal) {
            break;
        }
        // A step that is short because it was held back says nothing about how far the valley goes on.
        if fall.is_none_or(|fall| fall < config.tolerance && damping < HELD_BACK) {
            break;
        }
    }
    search.finish(iterations, known)
}

/// Fits the local parameters alone, the globals held; the cost then judges the globals on other data.
pub fn judge(problem: &dyn OutputError, globals: &[f64]) -> Fit {
    let held: Vec<Free> =
        globals.iter().map(|value| Free { start: *value, bounds: (*value, *value), scale: 1.0 }).collect();
    // Locals enter almost linearly: a few steps suffice.
    fit(problem, &held, None, &FitConfig { iterations: 6, tolerance: 1e-6, goal: None })
}

/// A search under way.
struct Search<'a> {
    problem: &'a dyn OutputError,
    free: &'a [Free],
    globals: Vec<f64>,
    locals: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
    scratch: Vec<f64>,
}

fn sum_of_squares(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|value| value * value).sum();
    // A simulation that ran away must lose against any that did not.
    if sum.is_finite() { sum } else { f64::MAX }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<'a> Search<'a> {
    fn start(problem: &'a dyn OutputError, free: &'a [Free], locals: Option<&[f64]>) -> Self {
        let count = problem.units().len() * problem.locals();
        let locals =
            locals.filter(|given| given.len() == count).map_or_else(|| vec![0.0; count], <[f64]>::to_vec);
        let globals: Vec<f64> =
            free.iter().map(|free| free.start.clamp(free.bounds.0, free.bounds.1)).collect();
        let mut residuals = vec![0.0; problem.len()];
        problem.residuals(&globals, &locals, &mut residuals);
        let cost = sum_of_squares(&residuals);
        let scratch = vec![0.0; residuals.len()];
        Self { problem, free, globals, locals, residuals, cost, scratch }
    }

    /// The difference quotient of the residuals by global `index`.
    fn column(&mut self, index: usize) -> Vec<f64> {
        let free = self.free[index];
        let held = self.globals[index];
        let size = (DERIVATIVE_STEP * held.abs().max(free.scale)).max(f64::MIN_POSITIVE);
        let step = if held + size > free.bounds.1 { -size } else { size };
        self.globals[index] = held + step;
        self.problem.residuals(&self.globals, &self.locals, &mut self.scratch);
        self.globals[index] = held;
        self.quotient(step)
    }

    /// The difference quotient by local `index` of every unit at once: units do not see each other.
    fn local_column(&mut self, index: usize) -> Vec<f64> {
        let count = self.problem.locals();
        let step = 1e-3 * self.problem.local_scale(index);
        let mut moved = self.locals.clone();
        moved.iter_mut().skip(index).step_by(count.max(1)).for_each(|local| *local += step);
        self.problem.residuals(&self.globals, &moved, &mut self.scratch);
        self.quotient(step)
    }

    fn quotient(&self, step: f64) -> Vec<f64> {
        let slopes = self.scratch.iter().zip(&self.residuals).map(|(moved, at)| (moved - at) / step);
        slopes.map(|slope| if slope.is_finite() { slope } else { 0.0 }).collect()
    }

    fn normal(&mut self, known: Option<Normal>) -> Normal {
        let is_free = |free: &Free| free.bounds.0 < free.bounds.1;
        let columns: Vec<Vec<f64>> = (0..self.globals.len())
            .map(|index| {
                if is_free(&self.free[index]) { self.column(index) } else { vec![0.0; self.residuals.len()] }
            })
            .collect();
        let (local_columns, taken_at) = match known.filter(|known| self.is_near(&known.taken_at)) {
            Some(known) => (known.local_columns, known.taken_at),
            None => {
                let columns = (0..self.problem.locals()).map(|index| self.local_column(index));
                (columns.collect(), self.globals.clone())
            }
        };
        let mut residuals = self.residuals.clone();
        let mut bare_columns = columns.clone();
        for unit in self.problem.units() {
            let basis = orthonormal(&local_columns, unit);
            for column in bare_columns.iter_mut().chain(std::iter::once(&mut residuals)) {
                remove(&basis, &mut column[unit.clone()]);
            }
        }
        let size = columns.len();
        let hessian = DMatrix::from_fn(size, size, |row, column| {
            // The upper triangle mirrors the lower one.
            if row >= column { dot(&bare_columns[row], &bare_columns[column]) } else { 0.0 }
        });
        let hessian = DMatrix::from_fn(size, size, |row, column| hessian[(row.max(column), row.min(column))]);
        let gradient = DVector::from_fn(size, |row, _| dot(&bare_columns[row], &residuals));
        Normal { hessian, gradient, columns, bare_columns, local_columns, taken_at }
    }

    /// Whether the locals' derivatives taken there still hold: locals enter almost linearly.
    fn is_near(&self, taken_at: &[f64]) -> bool {
        let sizes = self.free.iter().map(|free| free.scale);
        let moved = self.globals.iter().zip(taken_at).zip(sizes);
        moved.into_iter().all(|((now, then), size)| (now - then).abs() <= MOVED * then.abs().max(size))
    }

    /// Tries one step; the share by which the cost fell, `None` when it did not.
    fn step(&mut self, normal: &Normal, damping: f64) -> Option<f64> {
        let change = self.direction(normal, damping);
        let globals: Vec<f64> = (0..self.globals.len())
            .map(|index| {
                (self.globals[index] + change[index])
                    .clamp(self.free[index].bounds.0, self.free[index].bounds.1)
            })
            .collect();
        let mut locals = self.moved_locals(normal, &globals);
        self.problem.residuals(&globals, &locals, &mut self.scratch);
        let mut cost = sum_of_squares(&self.scratch);
        if cost >= self.cost && !self.locals.is_empty() {
            // Locals foreseen for a long step may be far off where the globals alone are not.
            locals.clone_from(&self.locals);
            self.problem.residuals(&globals, &locals, &mut self.scratch);
            cost = sum_of_squares(&self.scratch);
        }
        // Not a number is no fall either.
        if !matches!(cost.partial_cmp(&self.cost), Some(std::cmp::Ordering::Less)) {
            return None;
        }
        let fall = (self.cost - cost) / self.cost;
        std::mem::swap(&mut self.residuals, &mut self.scratch);
        (self.globals, self.locals, self.cost) = (globals, locals, cost);
        Some(fall)
    }

    /// The damped Gauss-Newton step; parameters that stand at a bound and push against it stay.
    fn direction(&self, normal: &Normal, damping: f64) -> Vec<f64> {
        let size = self.globals.len();
        let moves: Vec<usize> = (0..size)
            .filter(|index| {
                let (free, value) = (&self.free[*index], self.globals[*index]);
                let down = normal.gradient[*index] > 0.0;
                let stuck = (down && value <= free.bounds.0) || (!down && value >= free.bounds.1);
                !stuck && normal.hessian[(*index, *index)] > 0.0
            })
            .collect();
        let mut change = vec![0.0; size];
        let scale: Vec<f64> = moves.iter().map(|index| normal.hessian[(*index, *index)].sqrt()).collect();
        let matrix = DMatrix::from_fn(moves.len(), moves.len(), |row, column| {
            let value = normal.hessian[(moves[row], moves[column])] / (scale[row] * scale[column]);
            if row == column { value + damping } else { value }
        });
        let right = DVector::from_fn(moves.len(), |row, _| -normal.gradient[moves[row]] / scale[row]);
        if let Some(cholesky) = matrix.cholesky() {
            let solution = cholesky.solve(&right);
            for (row, index) in moves.iter().enumerate() {
                change[*index] = solution[row] / scale[row];
            }
        }
        change
    }

    /// Locals that are best for the moved globals, to first order.
    fn moved_locals(&self, normal: &Normal, globals: &[f64]) -> Vec<f64> {
        let count = self.problem.locals();
        let mut locals = self.locals.clone();
        if count == 0 {
            return locals;
        }
        let mut expected = self.residuals.clone();
        for (index, column) in normal.columns.iter().enumerate() {
            let change = globals[index] - self.globals[index];
            if change != 0.0 {
                expected.iter_mut().zip(column).for_each(|(value, slope)| *value += change * slope);
            }
        }
        for (unit, own) in self.problem.units().iter().zip(locals.chunks_mut(count)) {
            for (local, change) in own.iter_mut().zip(least_squares(&normal.local_columns, unit, &expected)) {
                *local -= change;
            }
        }
        locals
    }

    fn finish(mut self, iterations: usize, known: Option<Normal>) -> Fit {
        // The last step was short: its derivatives are those of the end.
        let normal = known.unwrap_or_else(|| self.normal(None));
        let standard_errors = standard_errors(&normal, &self.residuals, self.problem.units());
        Fit {
            globals: self.globals,
            locals: self.locals,
            standard_errors,
            cost: self.cost,
            residuals: self.residuals,
            iterations,
        }
    }
}

/// An orthonormal basis of the columns over a unit (Gram-Schmidt, twice is enough for two or three columns).
fn orthonormal(columns: &[Vec<f64>], unit: &Range<usize>) -> Vec<Vec<f64>> {
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
fn remove(basis: &[Vec<f64>], part: &mut [f64]) {
    for direction in basis {
        let share = dot(direction, part);
        part.iter_mut().zip(direction).for_each(|(value, unit)| *value -= share * unit);
    }
}

/// The coefficients of the local columns that come nearest to `target` over a unit.
fn least_squares(columns: &[Vec<f64>], unit: &Range<usize>, target: &[f64]) -> Vec<f64> {
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

/// Number of clusters the residuals are cut into when one unit spans a whole log.
const CLUSTERS: usize = 40;

/// The larger of two standard errors: from white noise of the residuals' own size, and from what clusters of
/// residuals say, which holds for correlated residuals too.
fn standard_errors(normal: &Normal, residuals: &[f64], units: &[Range<usize>]) -> Vec<f64> {
    let size = normal.columns.len();
    let live: Vec<usize> = (0..size).filter(|index| normal.hessian[(*index, *index)] > 0.0).collect();
    let mut errors = vec![f64::INFINITY; size];
    let scale: Vec<f64> = live.iter().map(|index| normal.hessian[(*index, *index)].sqrt()).collect();
    let matrix = DMatrix::from_fn(live.len(), live.len(), |row, column| {
        normal.hessian[(live[row], live[column])] / (scale[row] * scale[column])
    });
    let Some(inverse) = matrix.cholesky().map(|cholesky| cholesky.inverse()) else { return errors };
    let used = residuals.iter().filter(|value| **value != 0.0).count();
    let spent = live.len() + units.len() * normal.local_columns.len();
    let variance = sum_of_squares(residuals) / used.saturating_sub(spent).max(1) as f64;
    let mut meat = DMatrix::zeros(live.len(), live.len());
    for cluster in clusters(units, residuals.len()) {
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
    let longest = (len / CLUSTERS).max(1);
    let cut = |unit: &Range<usize>| {
        let end = unit.end;
        unit.clone().step_by(longest).map(move |from| from..(from + longest).min(end))
    };
    units.iter().flat_map(cut).collect()
}

#[cfg(test)]
mod tests;
