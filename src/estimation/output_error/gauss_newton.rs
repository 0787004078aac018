//! The steps of an output-error fit: Gauss-Newton with Levenberg-Marquardt damping, locals eliminated unit by unit.

use std::ops::{ControlFlow, Range};

use super::super::damping::Damping;
use super::super::fit_problem::{Fit, FitConfig, Free, LOCAL_STEP, OutputError};
use super::super::measured_rows::Residuals;
use super::super::normal_equations::{Normal, Slopes, least_squares, standard_errors, sum_of_squares};
use super::super::thresholds::THRESHOLDS;
use super::super::unit_rescue;
use crate::cancel;
use crate::threads::spread;

/// A step that lowered the cost.
pub(super) struct AcceptedStep {
    /// Share by which it did, and by which it should have.
    fall: f64,
    predicted: f64,
    /// By what the parameters moved.
    globals: Vec<f64>,
    locals: Vec<f64>,
}

impl AcceptedStep {
    fn went_as_predicted(&self) -> bool {
        let (least, most) = THRESHOLDS.as_predicted;
        (least..most).contains(&(self.fall / self.predicted))
    }
}

/// The residuals of the rows that are kept; `whole` is room for all of them where these are others.
fn simulate(
    problem: &dyn OutputError,
    (globals, locals): (&[f64], &[f64]),
    whole: &mut Vec<f64>,
    kept: &mut Vec<f64>,
) {
    let Some(rows) = problem.measured() else {
        kept.resize(problem.len(), 0.0);
        return problem.residuals(globals, locals, kept);
    };
    whole.resize(problem.len(), 0.0);
    problem.residuals(globals, locals, whole);
    rows.take(whole, kept);
}

/// What the derivatives of the next step are.
enum Derivatives {
    /// Those at hand.
    Known,
    /// Those at hand, and what this step shows of how they changed.
    Updated(AcceptedStep),
    /// Made anew.
    Fresh,
}

/// Where a search stands between two steps.
pub(super) struct Descent {
    normal: Normal,
    derivatives: Derivatives,
    damping: Damping,
    /// Steps in a row with derivatives that were not made for them.
    on: usize,
}

impl Descent {
    /// From these derivatives.
    pub(super) fn from(normal: Normal) -> Self {
        Self { normal, derivatives: Derivatives::Known, damping: Damping::new(), on: 0 }
    }
}

/// A search under way.
pub(super) struct GaussNewton<'a> {
    problem: &'a dyn OutputError,
    free: &'a [Free],
    globals: Vec<f64>,
    locals: Vec<f64>,
    /// Of the rows that are kept, as all that follows but `whole`.
    pub(super) residuals: Vec<f64>,
    pub(super) cost: f64,
    scratch: Vec<f64>,
    /// Where residuals are written before those that are kept are taken; empty where all are.
    whole: Vec<f64>,
}

impl<'a> GaussNewton<'a> {
    pub(super) fn start(problem: &'a dyn OutputError, free: &'a [Free], locals: Option<&[f64]>) -> Self {
        let count = problem.units().len() * problem.locals();
        let locals =
            locals.filter(|given| given.len() == count).map_or_else(|| vec![0.0; count], <[f64]>::to_vec);
        let globals: Vec<f64> = free.iter().map(|free| free.within(free.start)).collect();
        let (mut residuals, mut whole) = (Vec::new(), Vec::new());
        simulate(problem, (&globals, &locals), &mut whole, &mut residuals);
        let cost = sum_of_squares(&residuals);
        let scratch = vec![0.0; residuals.len()];
        Self { problem, free, globals, locals, residuals, cost, scratch, whole }
    }

    /// Steps until they lead no further; the derivatives of the end.
    pub(super) fn go_on(&mut self, mut at: Descent, config: &FitConfig) -> (Normal, usize) {
        loop {
            match self.advance(at, config) {
                ControlFlow::Continue(next) => at = next,
                ControlFlow::Break(end) => return end,
            }
        }
    }

    /// A step and where it leads, or the derivatives of the end and the steps tried.
    pub(super) fn advance(
        &mut self,
        Descent { normal, derivatives, mut damping, on }: Descent,
        config: &FitConfig,
    ) -> ControlFlow<(Normal, usize), Descent> {
        if damping.is_spent(config) {
            return ControlFlow::Break((normal, damping.tried()));
        }
        let normal = match derivatives {
            Derivatives::Known => normal,
            Derivatives::Updated(step) => {
                // The step was the last to swap the residuals.
                let residuals = (self.scratch.as_slice(), self.residuals.as_slice());
                self.assembled(normal.updated((&step.globals, &step.locals), residuals, self.units()))
            }
            Derivatives::Fresh => self.normal(Some(normal)),
        };
        // Other derivatives, or none to follow: a shorter step is not what is wanting.
        let may_shorten = on == 0 && normal.leads_on();
        let step = damping.descend(config, may_shorten, |damping| self.step(&normal, damping));
        let fall = step.as_ref().map(|step| step.fall);
        let is_given_up = damping.is_given_up(fall, self.cost, config);
        let is_there = fall.is_none_or(|fall| fall < config.tolerance && damping.is_low());
        if is_given_up || (is_there && !(on > 0 && fall.is_none())) {
            return ControlFlow::Break((normal, damping.tried()));
        }
        let may_update = config.reuses_slopes && on < THRESHOLDS.reused_steps;
        let (derivatives, on) = match step.filter(|step| may_update && step.went_as_predicted()) {
            Some(step) => (Derivatives::Updated(step), on + 1),
            None => (Derivatives::Fresh, 0),
        };
        ControlFlow::Continue(Descent { normal, derivatives, damping, on })
    }

    /// Fits units by themselves that leave much; whether that helped.
    pub(super) fn rescue_units(&mut self) -> bool {
        let of_units = |units: &[Range<usize>]| -> (Vec<f64>, Vec<usize>) {
            units.iter().map(|unit| (sum_of_squares(&self.residuals[unit.clone()]), unit.len())).unzip()
        };
        let (squares, lengths) = of_units(self.units());
        let mut locals = self.locals.clone();
        if !unit_rescue::rescue(self.problem, &self.globals, &mut locals, (&squares, &lengths)) {
            return false;
        }
        self.locals = locals;
        simulate(self.problem, (&self.globals, &self.locals), &mut self.whole, &mut self.residuals);
        self.cost = sum_of_squares(&self.residuals);
        true
    }

    /// The units among the rows that are kept.
    fn units(&self) -> &'a [Range<usize>] {
        self.problem.measured().map_or(self.problem.units(), |rows| rows.units())
    }

    /// The difference quotient of the residuals by global `index`.
    fn column(&self, index: usize) -> Vec<f64> {
        cancel::check();
        let free = self.free[index];
        let held = self.globals[index];
        let step = free.derivative_step(held);
        let mut globals = self.globals.clone();
        globals[index] = held + step;
        self.quotient(&globals, &self.locals, step)
    }

    /// The difference quotient by local `index` of every unit at once: units do not see each other.
    fn local_column(&self, index: usize) -> Vec<f64> {
        cancel::check();
        let count = self.problem.locals();
        let step = LOCAL_STEP * self.problem.local_scale(index);
        let mut moved = self.locals.clone();
        moved.iter_mut().skip(index).step_by(count.max(1)).for_each(|local| *local += step);
        self.quotient(&self.globals, &moved, step)
    }

    fn quotient(&self, globals: &[f64], locals: &[f64], step: f64) -> Vec<f64> {
        let mut moved = Vec::new();
        simulate(self.problem, (globals, locals), &mut Vec::new(), &mut moved);
        for (moved, at) in moved.iter_mut().zip(&self.residuals) {
            let slope = (*moved - at) / step;
            *moved = if slope.is_finite() { slope } else { 0.0 };
        }
        moved
    }

    /// Columns, of long residuals on as many threads as there are: each by itself, so the same numbers whatever their number.
    fn columns(&self, count: usize, of: impl Fn(usize) -> Vec<f64> + Sync) -> Vec<Vec<f64>> {
        if self.problem.len() < THRESHOLDS.parallel_residuals {
            return (0..count).map(of).collect();
        }
        spread(&(0..count).collect::<Vec<usize>>(), |index| of(*index))
    }

    pub(super) fn normal(&self, known: Option<Normal>) -> Normal {
        // Of what was known the columns by the globals make room for the new ones.
        let known = known.map(|known| (known.slopes.local_columns, known.slopes.taken_at));
        let known = known.filter(|(_, taken_at)| self.is_near(taken_at));
        let columns = self.columns(self.globals.len(), |index| {
            if self.free[index].is_free() { self.column(index) } else { vec![0.0; self.residuals.len()] }
        });
        let (local_columns, taken_at) = match known {
            Some(known) => known,
            None => {
                let columns = self.columns(self.problem.locals(), |index| self.local_column(index));
                (columns, self.globals.clone())
            }
        };
        self.assembled(Slopes { columns, local_columns, taken_at })
    }

    pub(super) fn assembled(&self, slopes: Slopes) -> Normal {
        Normal::of(slopes, &self.residuals, self.units())
    }

    /// Whether the locals' derivatives taken there still hold: locals enter almost linearly.
    fn is_near(&self, taken_at: &[f64]) -> bool {
        let sizes = self.free.iter().map(|free| free.scale);
        let moved = self.globals.iter().zip(taken_at).zip(sizes);
        moved
            .into_iter()
            .all(|((now, then), size)| (now - then).abs() <= THRESHOLDS.moved * then.abs().max(size))
    }

    /// Tries one step; `None` when the cost did not fall.
    fn step(&mut self, normal: &Normal, damping: f64) -> Option<AcceptedStep> {
        let change = normal.direction(self.free, &self.globals, damping);
        let globals: Vec<f64> = (0..self.globals.len())
            .map(|index| self.free[index].within(self.globals[index] + change[index]))
            .collect();
        let mut locals = self.moved_locals(normal, &globals);
        simulate(self.problem, (&globals, &locals), &mut self.whole, &mut self.scratch);
        let mut cost = sum_of_squares(&self.scratch);
        if cost >= self.cost && !self.locals.is_empty() && globals != self.globals {
            // Locals foreseen for a long step may be far off where the globals alone are not.
            locals.clone_from(&self.locals);
            simulate(self.problem, (&globals, &locals), &mut self.whole, &mut self.scratch);
            cost = sum_of_squares(&self.scratch);
        }
        // Not a number is no fall either.
        if !matches!(cost.partial_cmp(&self.cost), Some(std::cmp::Ordering::Less)) {
            return None;
        }
        let difference = |now: &[f64], before: &[f64]| -> Vec<f64> {
            now.iter().zip(before).map(|(now, before)| now - before).collect()
        };
        let step = AcceptedStep {
            fall: (self.cost - cost) / self.cost,
            predicted: normal.predicted_fall(&difference(&globals, &self.globals)) / self.cost,
            globals: difference(&globals, &self.globals),
            locals: difference(&locals, &self.locals),
        };
        std::mem::swap(&mut self.residuals, &mut self.scratch);
        (self.globals, self.locals, self.cost) = (globals, locals, cost);
        Some(step)
    }

    /// Locals that are best for the moved globals, to first order.
    fn moved_locals(&self, normal: &Normal, globals: &[f64]) -> Vec<f64> {
        let count = self.problem.locals();
        let mut locals = self.locals.clone();
        if count == 0 {
            return locals;
        }
        let mut expected = self.residuals.clone();
        for (index, column) in normal.slopes.columns.iter().enumerate() {
            let change = globals[index] - self.globals[index];
            if change != 0.0 {
                expected.iter_mut().zip(column).for_each(|(value, slope)| *value += change * slope);
            }
        }
        for (place, (unit, own)) in self.units().iter().zip(locals.chunks_mut(count)).enumerate() {
            let changes = least_squares(&normal.slopes.local_columns, unit, &expected);
            for (index, (local, change)) in own.iter_mut().zip(changes).enumerate() {
                let (low, high) = self.problem.local_bounds(place, index);
                *local = (*local - change).max(low).min(high);
            }
        }
        locals
    }

    /// The last step was short: its derivatives are those of the end.
    pub(super) fn finish(self, iterations: usize, normal: Normal) -> (Fit, Slopes) {
        let rows = self.problem.measured();
        let layout = (self.problem.units(), self.problem.len());
        let standard_errors = standard_errors(&normal, &self.residuals, layout, rows.map(|rows| &**rows));
        let fit = Fit {
            globals: self.globals,
            locals: self.locals,
            standard_errors,
            cost: self.cost,
            residuals: Residuals::of_measured(self.residuals, rows.cloned()),
            iterations,
        };
        (fit, normal.slopes)
    }
}
