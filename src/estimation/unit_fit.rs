//! Output-error fits of very many short units, as windows cut from long data: derivatives are made a few units at a time, taken into the
//! normal equations, and let go of. Kept are the residuals of the end and, of each unit, what its locals and its score follow from:
//! of an hour at 1 kHz a tenth of what the derivatives take.
//!
//! Problem, steps and standard errors are those of [`output_error`](super::output_error); but no derivatives serve a second step, and
//! a fit also ends behind a step that lowered the cost as the normal equations predicted, and to where they lead no further: what is
//! left is as little as they were off.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::damping::Damping;
use super::fit_problem::{Fit, FitConfig, Free, LOCAL_STEP, OutputError, UnitResiduals};
use super::measured_rows::Residuals;
use super::normal_equations::{Normal, Slopes, errors_of, longest_cluster, sum_of_squares};
use super::thresholds::THRESHOLDS;
use super::unit_rescue;
use super::unit_slopes::{UnitSlopes, local_step, moved_local, quotients};
use crate::threads::spread_out;

/// Fits a problem of very many short units; `None` of any other.
pub(super) fn fit(
    problem: &dyn OutputError,
    free: &[Free],
    locals: Option<&[f64]>,
    config: &FitConfig,
) -> Option<Fit> {
    if !takes(problem) {
        return None;
    }
    let globals: Vec<f64> = free.iter().map(|free| free.within(free.start)).collect();
    let at = problem.by_units(&globals)?;
    let count = problem.units().len() * problem.locals();
    let locals =
        locals.filter(|given| given.len() == count).map_or_else(|| vec![0.0; count], <[f64]>::to_vec);
    let fit = UnitFit { problem, free };
    let from = Place { globals, locals };
    let is_any_free = free.iter().any(Free::is_free);
    let at = (!is_any_free).then_some(at);
    let fitted = |from: Place| match &at {
        None => fit.all(from, config),
        Some(at) => fit.locals(from, at.as_ref(), config),
    };
    let found = fitted(from);
    Some(fit.rescued(&found, config).map_or(found, fitted))
}

/// Whether a problem is of very many short units.
pub(super) fn takes(problem: &dyn OutputError) -> bool {
    let len = problem.len();
    let is_short = |unit: &Range<usize>| unit.len() <= longest_cluster(len);
    are_many(problem) && problem.locals() > 0 && problem.units().iter().all(is_short)
}

/// Residuals of which no more than the least is kept.
fn are_many(problem: &dyn OutputError) -> bool {
    problem.len() > THRESHOLDS.kept_slopes
}

/// Sum of the squares of very many residuals; `None` where they are few, or not made of a few units at a time.
#[must_use]
pub fn cost(problem: &dyn OutputError, globals: &[f64], locals: &[f64]) -> Option<f64> {
    if !are_many(problem) {
        return None;
    }
    let at = problem.by_units(globals)?;
    let fit = UnitFit { problem, free: &[] };
    let squares = fit.in_blocks(&mut [], |block, _| {
        let mut residuals = vec![0.0; fit.rows(&block).len()];
        at.write(block.clone(), fit.own(locals, &block), &mut residuals);
        sum_of_squares(&residuals)
    });
    Some(finite(squares.into_iter().sum()))
}

/// A problem of many units.
struct UnitFit<'a> {
    problem: &'a dyn OutputError,
    free: &'a [Free],
}

/// Where a fit is.
#[derive(Clone)]
struct Place {
    globals: Vec<f64>,
    locals: Vec<f64>,
}

/// The problem with a global moved, and by how much.
type Moved<'a> = Option<(Box<dyn UnitResiduals + 'a>, f64)>;

/// The problem near a place, to first order.
struct Linear {
    normal: Normal,
    cost: f64,
    /// Unit by unit.
    units: Vec<UnitSlopes>,
}

impl UnitFit<'_> {
    /// Fits globals and locals.
    fn all(&self, mut now: Place, config: &FitConfig) -> Fit {
        let mut kept = vec![0.0; self.kept()];
        let mut linear = self.linear(&now);
        let mut cost = linear.cost;
        let mut damping = Damping::new();
        // By what the last step moved the globals since they were linearized; whether `kept` is of where the fit is.
        let (mut moved, mut is_written) = (vec![0.0; now.globals.len()], false);
        while !damping.is_spent(config) {
            let step = damping.descend(config, linear.normal.leads_on(), |damping| {
                let step = self.step(&now, (&linear, cost), damping, &mut kept);
                is_written = step.is_some();
                step
            });
            let Some((next, after)) = step else { break };
            moved = difference(&next.globals, &now.globals);
            let fall = (cost - after) / cost;
            let unforeseen = (fall - linear.normal.predicted_fall(&moved) / cost).abs();
            let left = linear.normal.left_to_fall(&moved, self.free, &next.globals) / cost;
            (now, cost) = (next, after);
            if damping.is_given_up(Some(fall), cost, config) {
                break;
            }
            let is_predicted = unforeseen.max(left) * (kept.len() as f64) < THRESHOLDS.predicted;
            let is_there = damping.is_low() && (fall < config.tolerance || is_predicted);
            if is_there || damping.is_spent(config) {
                break;
            }
            linear = self.linear(&now);
            moved.fill(0.0);
        }
        if !is_written {
            self.write(&now, &mut kept);
        }
        let standard_errors = self.standard_errors(&linear, &moved, &kept);
        self.fit(now, (cost, damping.tried()), standard_errors, kept)
    }

    /// Where a fit goes on once units that left much were fitted by themselves; `None` where none did.
    fn rescued(&self, found: &Fit, config: &FitConfig) -> Option<Place> {
        if !config.rescues_units || config.goal.is_some_and(|goal| found.cost > goal) {
            return None;
        }
        let left = found.residuals.measured();
        let of_unit = |unit: usize| {
            let places = self.places(&(unit..unit + 1));
            (sum_of_squares(&left[places.clone()]), places.len())
        };
        let (squares, lengths): (Vec<f64>, Vec<usize>) = (0..self.problem.units().len()).map(of_unit).unzip();
        let (globals, mut locals) = (found.globals.clone(), found.locals.clone());
        unit_rescue::rescue(self.problem, &globals, &mut locals, (&squares, &lengths))
            .then_some(Place { globals, locals })
    }

    /// Fits the locals of every unit, the globals held: of a few units as long as their cost falls.
    fn locals(&self, from: Place, at: &dyn UnitResiduals, config: &FitConfig) -> Fit {
        let mut kept = vec![0.0; self.kept()];
        let scales = self.local_steps();
        let done = self.in_blocks(&mut kept, |block, kept| {
            let rows = self.rows(&block);
            let mut own = self.own(&from.locals, &block).to_vec();
            let mut residuals = vec![0.0; rows.len()];
            at.write(block.clone(), &own, &mut residuals);
            let units = self.within(&block);
            let steps = (0..config.iterations)
                .take_while(|_| {
                    local_step((at, &block, &units), (&scales, config.tolerance), &mut own, &mut residuals)
                })
                .count();
            self.keep((&block, &residuals), kept);
            (own, sum_of_squares(&residuals), steps)
        });
        let cost = finite(done.iter().map(|(_, cost, _)| cost).sum());
        let iterations = done.iter().map(|(.., steps)| *steps).max().unwrap_or(0);
        let locals = done.into_iter().flat_map(|(own, ..)| own).collect();
        let errors = vec![f64::INFINITY; self.free.len()];
        self.fit(Place { locals, ..from }, (cost, iterations), errors, kept)
    }

    fn fit(
        &self,
        end: Place,
        (cost, iterations): (f64, usize),
        standard_errors: Vec<f64>,
        kept: Vec<f64>,
    ) -> Fit {
        let Place { globals, locals } = end;
        let residuals = Residuals::of_measured(kept, self.problem.measured().cloned());
        Fit { globals, locals, standard_errors, cost, residuals, iterations }
    }

    /// The problem to first order.
    fn linear(&self, now: &Place) -> Linear {
        let size = now.globals.len();
        let moved: Vec<Moved> = (0..size).map(|index| self.moved(&now.globals, index)).collect();
        let found = match self.problem.by_units(&now.globals) {
            Some(at) => self.in_blocks(&mut [], |block, _| {
                self.slopes(&block, (at.as_ref(), &moved), self.own(&now.locals, &block))
            }),
            None => Vec::new(),
        };
        let (mut hessian, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let (mut units, mut cost) = (Vec::with_capacity(self.problem.units().len()), 0.0);
        for (squares, slopes) in found {
            cost += squares;
            for unit in slopes {
                hessian += &unit.hessian;
                gradient += &unit.score;
                units.push(unit);
            }
        }
        let normal = Normal { hessian, gradient, slopes: Slopes::default() };
        Linear { normal, cost: finite(cost), units }
    }

    /// The problem with one of the globals moved by the step of its derivative; `None` of one that is held.
    fn moved(&self, globals: &[f64], index: usize) -> Moved<'_> {
        let free = self.free.get(index).filter(|free| free.is_free())?;
        let step = free.derivative_step(globals[index]);
        let mut globals = globals.to_vec();
        globals[index] += step;
        Some((self.problem.by_units(&globals)?, step))
    }

    /// Some units to first order, and their sum of squares; `own` are their locals.
    fn slopes(
        &self,
        block: &Range<usize>,
        (at, moved): (&dyn UnitResiduals, &[Moved]),
        own: &[f64],
    ) -> (f64, Vec<UnitSlopes>) {
        let steps = self.local_steps();
        let mut residuals = vec![0.0; self.rows(block).len()];
        at.write(block.clone(), own, &mut residuals);
        let quotient = |of: &dyn UnitResiduals, locals: &[f64], step: f64| {
            let mut column = vec![0.0; residuals.len()];
            of.write(block.clone(), locals, &mut column);
            quotients(&mut column, &residuals, step);
            column
        };
        let of_local = |index: usize| quotient(at, &moved_local(own, index, &steps), steps[index]);
        let local_columns: Vec<Vec<f64>> = (0..steps.len()).map(of_local).collect();
        let of_global = |moved: &Moved| match moved {
            Some((of, step)) => quotient(of.as_ref(), own, *step),
            None => vec![0.0; residuals.len()],
        };
        let columns: Vec<Vec<f64>> = moved.iter().map(of_global).collect();
        let units = self.within(block).into_iter();
        let slopes = units.map(|unit| UnitSlopes::of(&unit, &residuals, &columns, &local_columns));
        (sum_of_squares(&residuals), slopes.collect())
    }

    /// Tries one step, and where the cost falls gives where it ends and the cost there; its residuals are in `kept` then.
    fn step(
        &self,
        now: &Place,
        (linear, cost): (&Linear, f64),
        damping: f64,
        kept: &mut [f64],
    ) -> Option<(Place, f64)> {
        let change = linear.normal.direction(self.free, &now.globals, damping);
        let globals: Vec<f64> = (0..change.len())
            .map(|index| self.free[index].within(now.globals[index] + change[index]))
            .collect();
        let change = DVector::from_vec(difference(&globals, &now.globals));
        let count = self.problem.locals();
        let moved = now.locals.chunks(count).zip(&linear.units).flat_map(|(own, unit)| {
            let change = unit.local_change(&change);
            own.iter().zip(&change).map(|(local, change)| local + change).collect::<Vec<f64>>()
        });
        let next = Place { globals, locals: moved.collect() };
        let after = self.write(&next, kept);
        if after < cost {
            return Some((next, after));
        }
        // Locals foreseen for a long step may be far off where the globals alone are not.
        let next = Place { locals: now.locals.clone(), ..next };
        let after = if next.globals == now.globals { cost } else { self.write(&next, kept) };
        (after < cost).then_some((next, after))
    }

    /// Writes the residuals that are kept of a place; their sum of squares.
    fn write(&self, place: &Place, kept: &mut [f64]) -> f64 {
        let Some(at) = self.problem.by_units(&place.globals) else { return f64::MAX };
        let squares = self.in_blocks(kept, |block, kept| {
            let mut residuals = vec![0.0; self.rows(&block).len()];
            at.write(block.clone(), self.own(&place.locals, &block), &mut residuals);
            self.keep((&block, &residuals), kept);
            sum_of_squares(&residuals)
        });
        finite(squares.into_iter().sum())
    }

    /// Each unit is a cluster of residuals as good as independent. Its score behind a step that moved the globals follows from the one
    /// before.
    fn standard_errors(&self, linear: &Linear, moved: &[f64], kept: &[f64]) -> Vec<f64> {
        let moved = DVector::from_column_slice(moved);
        errors_of(
            &linear.normal.hessian,
            (kept, self.problem.units().len() * self.problem.locals()),
            |live, scale| {
                let mut meat = DMatrix::zeros(live.len(), live.len());
                for unit in &linear.units {
                    let all = &unit.score + &unit.hessian * &moved;
                    let score = DVector::from_fn(live.len(), |row, _| all[live[row]] / scale[row]);
                    meat += &score * score.transpose();
                }
                meat
            },
        )
    }

    /// Does the work for some units at a time on every core, each with its part of the residuals that are kept; `kept` may be empty
    /// where none are.
    fn in_blocks<R: Send>(
        &self,
        mut kept: &mut [f64],
        work: impl Fn(Range<usize>, &mut [f64]) -> R + Sync,
    ) -> Vec<R> {
        let units = self.problem.units();
        let is_kept = !kept.is_empty();
        let mut blocks = Vec::with_capacity(units.len().div_ceil(THRESHOLDS.units_together));
        for from in (0..units.len()).step_by(THRESHOLDS.units_together) {
            let block = from..(from + THRESHOLDS.units_together).min(units.len());
            let wanted = if is_kept { self.places(&block).len() } else { 0 };
            let (part, rest) = std::mem::take(&mut kept).split_at_mut_checked(wanted).unwrap_or_default();
            kept = rest;
            blocks.push((block, part));
        }
        spread_out(blocks, |(block, part)| work(block, part))
    }

    /// The rows of some units in the whole vector of residuals.
    fn rows(&self, block: &Range<usize>) -> Range<usize> {
        let units = &self.problem.units()[block.clone()];
        units.first().map_or(0, |first| first.start)..units.last().map_or(0, |last| last.end)
    }

    /// Each of some units, from the first row of them on.
    fn within(&self, block: &Range<usize>) -> Vec<Range<usize>> {
        let first = self.rows(block).start;
        self.problem.units()[block.clone()].iter().map(|unit| unit.start - first..unit.end - first).collect()
    }

    /// The rows of some units among those that are kept.
    fn places(&self, block: &Range<usize>) -> Range<usize> {
        let rows = self.rows(block);
        self.problem.measured().map_or_else(|| rows.clone(), |measured| measured.within(&rows))
    }

    /// How many residuals are kept.
    fn kept(&self) -> usize {
        self.problem.measured().map_or(self.problem.len(), |measured| measured.count())
    }

    fn keep(&self, (block, residuals): (&Range<usize>, &[f64]), kept: &mut [f64]) {
        match self.problem.measured() {
            Some(rows) => rows.take_part(self.places(block), (self.rows(block).start, residuals), kept),
            None => kept.copy_from_slice(residuals),
        }
    }

    /// The locals of some units.
    fn own<'b>(&self, locals: &'b [f64], block: &Range<usize>) -> &'b [f64] {
        let count = self.problem.locals();
        locals.get(block.start * count..block.end * count).unwrap_or(&[])
    }

    /// The steps of the locals' difference quotients.
    fn local_steps(&self) -> Vec<f64> {
        (0..self.problem.locals()).map(|index| LOCAL_STEP * self.problem.local_scale(index)).collect()
    }
}

fn difference(now: &[f64], before: &[f64]) -> Vec<f64> {
    now.iter().zip(before).map(|(now, before)| now - before).collect()
}

/// A simulation that ran away must lose against any that did not.
fn finite(cost: f64) -> f64 {
    if cost.is_finite() { cost } else { f64::MAX }
}

#[cfg(test)]
mod tests;
