//! The fit of a candidate: where it starts, from which starts it is fitted to the end, and the held-out error.

use super::block_data::BlockData;
use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::grid_refine;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::normal_equations::Slopes;
use crate::estimation::output_error::{
    Fit, FitConfig, Free, Residuals, fit, fit_best, fit_from, validate, validate_from,
};
use crate::model::Model;

/// Starting points of a candidate, ranked by a first look.
#[derive(Clone)]
pub struct StartingPoints {
    template: Model,
    names: Vec<String>,
    /// Best first.
    starts: Vec<StartingPoint>,
    /// Whether the starts are ends of a way on a part of the data, and not places on it.
    is_on_part: bool,
    /// Whether they are ends of a brief fit on all training data.
    is_fitted_on_all: bool,
    /// The way that is left from the starts.
    way: FitConfig,
}

/// One starting point.
#[derive(Clone)]
pub(crate) struct StartingPoint {
    /// On the data that it was looked at on.
    pub cost: f64,
    pub model: Model,
    /// Initial states on all training data; empty where those are not what it was looked at on.
    pub locals: Vec<f64>,
}

impl StartingPoint {
    /// Where a fit ended; `is_all` = on all training data.
    pub(crate) fn at_end(end: Fit, problem: &Problem, is_all: bool) -> Self {
        let model = problem.model(&end.globals);
        Self { cost: end.cost, model, locals: if is_all { end.locals } else { Vec::new() } }
    }
}

impl StartingPoints {
    /// The least cost seen on the part of the data looked at.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.starts.first().map_or(f64::INFINITY, |start| start.cost)
    }

    /// Whether the cost is that of a brief fit on all training data.
    #[must_use]
    pub(crate) fn is_fitted_on_all(&self) -> bool {
        self.is_fitted_on_all
    }

    /// The same, with the fit that follows to go as far as it can.
    pub(crate) fn with_full_fit(self) -> Self {
        Self { way: THRESHOLDS.full_fit, ..self }
    }

    /// The same as ends of a way on a part of the data.
    pub(crate) fn near(self) -> Self {
        Self { is_on_part: true, ..self }
    }

    /// The best start, and the second where it is as good.
    fn best_starts(&self) -> impl Iterator<Item = &StartingPoint> {
        let limit = THRESHOLDS.second_start * self.starts.first().map_or(0.0, |start| start.cost);
        self.starts.iter().take(2).filter(move |start| start.cost <= limit)
    }
}

/// A fit to the end.
struct FullFit {
    fit: Fit,
    slopes: Slopes,
    /// With the standard errors of its numbers.
    model: Model,
    /// Numbers of a grid that the fitted data hardly tell from its own.
    hardly_worse: Vec<Vec<f64>>,
}

/// The model at the end of a fit, with how well its numbers are known.
pub(super) fn with_errors(problem: &Problem, names: &[String], fit: &Fit) -> Model {
    let mut model = problem.model(&fit.globals);
    for (name, error) in names.iter().zip(&fit.standard_errors) {
        if error.is_finite() {
            model.standard_errors.insert(name.clone(), *error);
        }
    }
    model
}

/// Whether a brief fit is of all data.
#[must_use]
pub fn fits_briefly_on_all(split: &DataSplit) -> bool {
    split.train.is_rotor() && split.shortened().is_none()
}

impl Candidate<'_> {
    /// Fits, and computes the held-out error.
    #[must_use]
    pub fn run(&self, split: &DataSplit) -> CandidateFit {
        self.finish(self.starting_points(split), split)
    }

    /// Fits from these starts without data that it has not seen: those that it was fitted on stand in their place.
    #[must_use]
    pub(crate) fn fit_alone(&self, starting_points: StartingPoints, split: &DataSplit) -> CandidateFit {
        let FullFit { fit, model, .. } = self.fitted(&starting_points, split);
        self.found(starting_points.names, model, (fit.clone(), fit))
    }

    /// As [`Candidate::run`], from where a fit on a part of the data ended.
    #[must_use]
    pub(crate) fn run_near(&self, split: &DataSplit) -> CandidateFit {
        self.finish(self.starting_points(split).near(), split)
    }

    /// The least cost on data when the candidate's numbers are fitted from where a model has them; not looked for any longer where
    /// it hardly falls any more and is above `goal`.
    #[must_use]
    pub(crate) fn cost_on(&self, data: &BlockData, model: &Model, goal: Option<f64>) -> f64 {
        let inside = self.inside(model);
        let names = self.names_in(&inside, data.is_rotor());
        let problem = Problem::new(data, model.clone(), names.clone(), &inside);
        fit(&problem, &self.frees(&names, model), None, &FitConfig { goal, ..THRESHOLDS.full_fit }).cost
    }

    /// Looks at every start.
    #[must_use]
    pub fn starting_points(&self, split: &DataSplit) -> StartingPoints {
        let mut template = self.from.clone();
        let mut fresh = Vec::new();
        for effect in &self.effects {
            if !template.has(&effect.id) {
                template = template.with(effect);
                fresh.push(*effect);
            }
        }
        let names = self.names_in(&self.inside(&template), split.train.is_rotor());
        let starts = if fresh.is_empty() {
            vec![StartingPoint { cost: 0.0, model: template.clone(), locals: Vec::new() }]
        } else {
            self.ranked_starts(self.starts(&template, &fresh, split), &names, split)
        };
        StartingPoints {
            template,
            names,
            starts,
            is_on_part: false,
            is_fitted_on_all: false,
            way: THRESHOLDS.full_fit,
        }
    }

    /// Fits from the best starts for a while. A body's to the end on a part of the data, as far as that may lead below `goal`:
    /// the fit on all of them then has little left to do. A rotor's on all data, unless they are very many, as far as it looks
    /// promising: their part is a piece of a run, where what drifts looks different. (Of very many it is two long pieces.)
    #[must_use]
    pub fn fit_briefly(
        &self,
        starting_points: StartingPoints,
        split: &DataSplit,
        goal: Option<f64>,
    ) -> StartingPoints {
        let on_all = fits_briefly_on_all(split);
        let (data, goal) = match &split.coarse {
            _ if on_all => (&split.train, self.without.map(|cost| THRESHOLDS.promising_share * cost)),
            Some(coarse) => (coarse, goal),
            None => return starting_points,
        };
        let problem = Problem::new(
            data,
            starting_points.template.clone(),
            starting_points.names.clone(),
            &self.inside(&starting_points.template),
        );
        let config = FitConfig { goal, ..THRESHOLDS.brief_fit };
        let from_start = |start: &StartingPoint| {
            let frees = self.frees(&starting_points.names, &start.model);
            let locals = on_all.then_some(start.locals.as_slice());
            StartingPoint::at_end(fit(&problem, &frees, locals, &config), &problem, on_all)
        };
        let mut starts: Vec<StartingPoint> = starting_points.best_starts().map(from_start).collect();
        starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        starts.truncate(1);
        StartingPoints {
            starts,
            is_on_part: !on_all,
            is_fitted_on_all: on_all,
            way: if on_all { THRESHOLDS.full_fit } else { THRESHOLDS.fold_fit },
            ..starting_points
        }
    }

    /// Fits from the best starts to the end, and computes the held-out error.
    #[must_use]
    pub fn finish(&self, starting_points: StartingPoints, split: &DataSplit) -> CandidateFit {
        let names = starting_points.names.as_slice();
        let FullFit { fit, slopes, model, hardly_worse } = self.fitted(&starting_points, split);
        let held_out = self.held_out(&model, (&fit, &slopes), names, split);
        let on_grid = self.moved_on_held_out((&model, names), (&fit, &held_out), &hardly_worse, split);
        let (model, fits) = on_grid.unwrap_or((model, (fit, held_out)));
        self.found(starting_points.names, model, fits)
    }

    /// The fit from the best of these starts, all of the same effects, the numbers of laws in jumps held; not looked for any longer where
    /// it hardly falls any more and is above `goal`.
    pub(crate) fn fit_grids_held(
        &self,
        starts: &[Model],
        goal: Option<f64>,
        split: &DataSplit,
    ) -> Option<CandidateFit> {
        let first = starts.first()?;
        let inside = self.inside(first);
        let names = self.names_in(&inside, split.train.is_rotor());
        let problem = Problem::new(&split.train, first.clone(), names.clone(), &inside);
        let starts: Vec<Vec<Free>> = starts.iter().map(|start| self.frees(&names, start)).collect();
        let best = fit_best(&problem, &starts, &FitConfig { goal, ..THRESHOLDS.full_fit }, 1);
        let fit = best.into_iter().next()?;
        Some(self.found(names.clone(), with_errors(&problem, &names, &fit), (fit.clone(), fit)))
    }

    fn found(&self, names: Vec<String>, model: Model, (fit, held_out): (Fit, Fit)) -> CandidateFit {
        let effects = self.effects.iter().map(|effect| effect.id.clone()).collect();
        CandidateFit { effects, model, names, fit, held_out }
    }

    /// Fits from the best starts to the end.
    fn fitted(&self, starting_points: &StartingPoints, split: &DataSplit) -> FullFit {
        let StartingPoints { template, names, .. } = starting_points;
        let inside = self.inside(template);
        let problem = Problem::new(&split.train, template.clone(), names.clone(), &inside);
        let to_the_end = FitConfig {
            goal: self.without.map(|cost| THRESHOLDS.promising_share * cost),
            ..starting_points.way
        };
        let short = split.shortened().filter(|_| !starting_points.is_on_part && !names.is_empty());
        let short = short.map(|data| Problem::new(data, template.clone(), names.clone(), &inside));
        let near = |model: &Model| {
            let end =
                short.as_ref().map(|short| fit(short, &self.frees(names, model), None, &THRESHOLDS.full_fit));
            let end = end.map(|end| problem.model(&end.globals));
            // A part that is not like the rest leads astray.
            end.filter(|end| problem.cost_of(end) < problem.cost_of(model)).unwrap_or_else(|| model.clone())
        };
        let ends = starting_points.best_starts().map(|start| {
            let frees = self.frees(names, &near(&start.model));
            fit_from(&problem, &frees, Some(&start.locals), &to_the_end, None)
        });
        let best = ends.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
        let from_template =
            || fit_from(&problem, &self.frees(names, template), None, &THRESHOLDS.full_fit, None);
        let (mut best, slopes) = best.unwrap_or_else(from_template);
        let is_promising = to_the_end.goal.is_none_or(|goal| best.cost < goal);
        let mut hardly_worse = Vec::new();
        for (index, name) in names.iter().enumerate().filter(|_| is_promising) {
            if self.is_discontinuous(name) {
                hardly_worse = self.fit_grid(&problem, (index, name, names), split, &mut best);
            }
        }
        let model = with_errors(&problem, names, &best);
        FullFit { fit: best, slopes, model, hardly_worse }
    }

    /// The residuals on data that the fit has not seen.
    fn held_out(
        &self,
        model: &Model,
        (best, slopes): (&Fit, &Slopes),
        names: &[String],
        split: &DataSplit,
    ) -> Fit {
        let inside = self.inside(model);
        let problem = |data| Problem::new(data, model.clone(), names.to_vec(), &inside);
        if split.folds.is_empty() {
            return validate(&problem(&split.validate), &best.globals);
        }
        let mut residuals = Residuals::zero(best.residuals.len(), split.train.measured_rows());
        let mut joint = Fit { cost: 0.0, ..best.clone() };
        // Their fits start where the one on all data ended. Grids were moved since then, and what is beside them.
        let is_any_discontinuous = names.iter().any(|name| self.is_discontinuous(name));
        let slopes = Some(slopes).filter(|_| !is_any_discontinuous);
        for (train, held_out) in &split.folds {
            let frees = self.frees(names, model);
            let (mut part, _) =
                fit_from(&problem(train), &frees, Some(&best.locals), &THRESHOLDS.fold_fit, slopes);
            for grid in (0..names.len()).filter(|index| self.is_discontinuous(&names[*index])) {
                let without_slope = self.without_slope(grid, names, model);
                grid_refine::refine(&problem(train), train, &without_slope, &[], &mut part);
            }
            self.reset_undetermined(&mut part, names, model);
            let from = slopes.map(|slopes| (best.locals.as_slice(), slopes.of_locals()));
            let from = from.as_ref().map(|(locals, slopes)| (*locals, slopes));
            let held_out = validate_from(&problem(held_out), &part.globals, from);
            joint.cost += held_out.cost;
            // Each sample is held out in one fold, and zero in the others.
            residuals.add(&held_out.residuals);
        }
        joint.residuals = residuals;
        joint
    }

    /// What the part's data do not determine stayed where all data had put it, the held-out ones among them: a level
    /// that is never seen must not tell where it is cut off. Such a parameter goes to where its effect is none.
    fn reset_undetermined(&self, part: &mut Fit, names: &[String], model: &Model) {
        for (index, name) in names.iter().enumerate().filter(|(_, name)| !self.has_no_slope(name, model)) {
            let neutral = self.parameter(name).map_or(f64::NAN, |parameter| parameter.neutral);
            if !part.standard_errors[index].is_finite() && neutral.is_finite() {
                part.globals[index] = neutral;
            }
        }
    }
}

#[cfg(test)]
mod tests;
