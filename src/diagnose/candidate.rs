//! How a trial is come by: where its fit starts, which starts are followed, and the judgement.

use super::block_data::BlockData;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::grid_search;
use super::problem::Problem;
use crate::effect::Law;
use crate::estimation::normal_equations::Slopes;
use crate::estimation::output_error::{Fit, FitConfig, Free, fit, fit_on, judge, judge_on};
use crate::model::{Effect, EffectParameter, Model};

/// What a trial may change, and where it starts.
#[derive(Debug, Clone)]
pub struct Plan<'a> {
    /// The model it starts from, with fitted parameters.
    pub from: &'a Model,
    /// The model whose base numbers nobody has refitted: a fit that starts far from them starts from them, too.
    pub home: &'a Model,
    /// Effects to add, in order; those at the end that `from` lacks are started from their cards.
    pub effects: Vec<&'a Effect>,
    /// Base parameters that are free.
    pub base: Vec<String>,
    /// Every effect the model may hold, to look up.
    pub known: &'a [Effect],
    /// Cost on the same data that the fit must come below to be worth its whole way, mostly of the set that one effect was
    /// added to; `None` where it does not matter.
    pub without: Option<f64>,
}

/// A plan that has been looked at: where it is worth starting.
pub struct Glance {
    template: Model,
    names: Vec<String>,
    /// Cost on the part of the data looked at, and the start, best first.
    starts: Vec<(f64, Model)>,
    /// Whether the starts are ends of a way on a part of the data, and not places on it.
    is_sketched: bool,
    /// The way that is left from the starts.
    way: FitConfig,
}

impl Glance {
    /// The least cost seen on the part of the data looked at.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.starts.first().map_or(f64::INFINITY, |(cost, _)| *cost)
    }

    /// The same, with the fit that follows to be followed as far as it goes.
    pub(crate) fn followed_to_the_end(self) -> Self {
        Self { way: FOLLOW, ..self }
    }

    /// The best start, and the second where it is as good.
    fn worth_following(&self) -> impl Iterator<Item = &(f64, Model)> {
        let limit = AS_GOOD * self.starts.first().map_or(0.0, |(cost, _)| *cost);
        self.starts.iter().take(2).filter(move |(cost, _)| *cost <= limit)
    }
}

/// The way to the end: a change of the cost by a hundred-thousandth decides nothing.
const FOLLOW: FitConfig = FitConfig { iterations: 40, tolerance: 1e-5, goal: None, goes_on: true };
/// As far as a set is followed before the best ones are chosen.
const SKETCH: FitConfig = FitConfig { iterations: 10, tolerance: 1e-3, goal: None, goes_on: true };
/// From the end of the fit on all data to that on a part of them it is not far, nor back.
const PART: FitConfig = FitConfig { iterations: 15, tolerance: 1e-4, goal: None, goes_on: true };
/// Share of the cost without the effect that a fit with it must fall below to be worth its whole way: [`gains`] asks for
/// more than what is left.
///
/// [`gains`]: super::model_selection::gains
const WORTH: f64 = 0.99;
/// A second start is followed when its first look was within this factor of the best.
const AS_GOOD: f64 = 1.1;

impl Plan<'_> {
    /// Fits and judges.
    #[must_use]
    pub fn run(&self, stage: &Stage) -> Trial {
        self.finish(self.glance(stage), stage)
    }

    /// The least cost on data when the plan's numbers are fitted from where a model has them; not looked for any longer where
    /// it hardly falls any more and is above `goal`.
    #[must_use]
    pub(crate) fn cost_on(&self, data: &BlockData, model: &Model, goal: Option<f64>) -> f64 {
        let inside = self.inside(model);
        let names = self.names_in(&inside, data.is_rotor());
        let problem = Problem::new(data, model.clone(), names.clone(), &inside);
        fit(&problem, &self.frees(&names, model), None, &FitConfig { goal, ..FOLLOW }).cost
    }

    /// Base numbers and parameters of the effects of a block that are free.
    fn names_in(&self, inside: &[&Effect], in_rotor: bool) -> Vec<String> {
        let mut names = self.base.clone();
        let in_block = inside.iter().filter(|effect| effect.site.is_rotor() == in_rotor);
        names.extend(in_block.flat_map(|effect| {
            effect.parameters.iter().map(move |parameter| format!("{}.{}", effect.id, parameter.name))
        }));
        names
    }

    /// Looks at every start.
    #[must_use]
    pub fn glance(&self, stage: &Stage) -> Glance {
        let mut template = self.from.clone();
        let mut fresh = Vec::new();
        for effect in &self.effects {
            if !template.has(&effect.id) {
                template = template.with(effect);
                fresh.push(*effect);
            }
        }
        let names = self.names_in(&self.inside(&template), stage.train.is_rotor());
        let starts = if fresh.is_empty() {
            vec![(0.0, template.clone())]
        } else {
            self.looked_at(self.starts(&template, &fresh, stage), &names, stage)
        };
        Glance { template, names, starts, is_sketched: false, way: FOLLOW }
    }

    /// Follows the best starts for a while. A body's to the end on a part of the data, as far as that may lead below `goal`:
    /// the fit on all of them then has little left to do. A rotor's on all data, unless they are very many, as far as it may be
    /// worth it: their part is the middle of a run, where what drifts looks different. (Of very many it is two long pieces.)
    #[must_use]
    pub fn sketch(&self, glance: Glance, stage: &Stage, goal: Option<f64>) -> Glance {
        let on_all = stage.train.is_rotor() && stage.shortened().is_none();
        let (data, goal) = match &stage.coarse {
            _ if on_all => (&stage.train, self.without.map(|cost| WORTH * cost)),
            Some(coarse) => (coarse, goal),
            None => return glance,
        };
        let problem =
            Problem::new(data, glance.template.clone(), glance.names.clone(), &self.inside(&glance.template));
        let config = FitConfig { goal, ..SKETCH };
        let follow = |(_, model): &(f64, Model)| {
            let end = fit(&problem, &self.frees(&glance.names, model), None, &config);
            (end.cost, problem.model(&end.globals))
        };
        let mut starts: Vec<(f64, Model)> = glance.worth_following().map(follow).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.truncate(1);
        Glance { starts, is_sketched: !on_all, way: if on_all { FOLLOW } else { PART }, ..glance }
    }

    /// Follows the best starts to the end, and judges.
    #[must_use]
    pub fn finish(&self, glance: Glance, stage: &Stage) -> Trial {
        let Glance { template, names, .. } = &glance;
        let inside = self.inside(template);
        let problem = Problem::new(&stage.train, template.clone(), names.clone(), &inside);
        let follow = FitConfig { goal: self.without.map(|cost| WORTH * cost), ..glance.way };
        let short = stage.shortened().filter(|_| !glance.is_sketched);
        let short = short.map(|data| Problem::new(data, template.clone(), names.clone(), &inside));
        let near = |model: &Model| {
            let end = short.as_ref().map(|short| fit(short, &self.frees(names, model), None, &FOLLOW));
            let end = end.map(|end| problem.model(&end.globals));
            // A part that is not like the rest leads astray.
            end.filter(|end| problem.cost_of(end) < problem.cost_of(model)).unwrap_or_else(|| model.clone())
        };
        let ends = glance
            .worth_following()
            .map(|(_, model)| fit_on(&problem, &self.frees(names, &near(model)), None, &follow, None));
        let best = ends.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
        let from_template = || fit_on(&problem, &self.frees(names, template), None, &FOLLOW, None);
        let (mut best, slopes) = best.unwrap_or_else(from_template);
        let is_worth_it = follow.goal.is_none_or(|goal| best.cost < goal);
        for (index, name) in names.iter().enumerate().filter(|_| is_worth_it) {
            if self.in_stairs(name) {
                // The value and the rest of the numbers depend on each other.
                grid_search::settle(&problem, &stage.train, index, &mut best);
                let settled = problem.model(&best.globals);
                best = fit(&problem, &self.frees(names, &settled), Some(&best.locals), &FOLLOW);
                if self.from.parameter(name).is_some() {
                    self.look_again(&problem, (name, names), stage, &mut best);
                }
                grid_search::polish(&problem, &stage.train, index, &mut best);
            }
        }
        let mut model = problem.model(&best.globals);
        for (name, error) in names.iter().zip(&best.standard_errors) {
            if error.is_finite() {
                model.standard_errors.insert(name.clone(), *error);
            }
        }
        let judged = self.judged(&model, (&best, &slopes), names, stage);
        Trial {
            effects: self.effects.iter().map(|effect| effect.id.clone()).collect(),
            model,
            names: names.clone(),
            fit: best,
            judged,
        }
    }

    /// A grid that was found while something else was missing may be another than the one beside it.
    fn look_again(&self, problem: &Problem, (name, names): (&str, &[String]), stage: &Stage, best: &mut Fit) {
        let Some(parameter) = self.parameter(name) else { return };
        let mut model = problem.model(&best.globals);
        let inside = self.inside(&model);
        let values = grid_search::values(&stage.train, &model, name, parameter.bounds, &inside);
        if let Some(value) = values.first() {
            model.set_parameter(name, *value);
            let again = fit(problem, &self.frees(names, &model), Some(&best.locals), &FOLLOW);
            if again.cost < best.cost {
                *best = again;
            }
        }
    }

    /// The residuals on data that the fit has not seen.
    fn judged(&self, model: &Model, (best, slopes): (&Fit, &Slopes), names: &[String], stage: &Stage) -> Fit {
        let inside = self.inside(model);
        let problem = |data| Problem::new(data, model.clone(), names.to_vec(), &inside);
        if stage.folds.is_empty() {
            return judge(&problem(&stage.validate), &best.globals);
        }
        let mut joint = Fit { residuals: vec![0.0; best.residuals.len()], cost: 0.0, ..best.clone() };
        // Their fits start where the one on all data ended. Stairs were moved since then, and what is beside them.
        let has_stairs = names.iter().any(|name| self.in_stairs(name));
        let slopes = Some(slopes).filter(|_| !has_stairs);
        for (train, held_out) in &stage.folds {
            let frees = self.frees(names, model);
            let (mut part, _) = fit_on(&problem(train), &frees, Some(&best.locals), &PART, slopes);
            for index in (0..names.len()).filter(|index| self.in_stairs(&names[*index])) {
                grid_search::settle(&problem(train), train, index, &mut part);
            }
            self.forget(&mut part, names);
            let from = slopes.map(|slopes| (best.locals.as_slice(), slopes.of_locals()));
            let from = from.as_ref().map(|(locals, slopes)| (*locals, slopes));
            let judged = judge_on(&problem(held_out), &part.globals, from);
            joint.cost += judged.cost;
            // Each sample is judged in one part, and zero in the others.
            joint.residuals.iter_mut().zip(&judged.residuals).for_each(|(sum, residual)| *sum += residual);
        }
        joint
    }

    /// What the part's data do not determine stayed where all data had put it, the held-out ones among them: a level
    /// that is never seen must not tell where it is cut off. Such a parameter goes to where its effect is none.
    fn forget(&self, part: &mut Fit, names: &[String]) {
        for (index, name) in names.iter().enumerate().filter(|(_, name)| !self.in_stairs(name)) {
            let neutral = self.parameter(name).map_or(f64::NAN, |parameter| parameter.neutral);
            if !part.standard_errors[index].is_finite() && neutral.is_finite() {
                part.globals[index] = neutral;
            }
        }
    }

    /// The parameter of an effect, looked up.
    fn parameter(&self, name: &str) -> Option<&EffectParameter> {
        let (id, parameter) = name.split_once('.')?;
        let effect = self.known.iter().find(|effect| effect.id == id)?;
        effect.parameters.iter().find(|known| known.name == parameter)
    }

    /// Effects of a model, looked up.
    pub(crate) fn inside(&self, model: &Model) -> Vec<&Effect> {
        self.known.iter().filter(|effect| model.has(&effect.id)).collect()
    }

    pub(crate) fn frees(&self, names: &[String], model: &Model) -> Vec<Free> {
        names.iter().map(|name| self.free(model, name)).collect()
    }

    /// Whether a parameter is one of a law without slope.
    pub(crate) fn in_stairs(&self, name: &str) -> bool {
        let id = name.split_once('.').map_or("", |(id, _)| id);
        self.known.iter().any(|effect| effect.id == id && matches!(effect.law, Law::Stairs(_)))
    }

    fn free(&self, model: &Model, name: &str) -> Free {
        let start = model.parameter(name).unwrap_or(0.0);
        if !name.contains('.') {
            return base_free(name, start);
        }
        // A law in jumps is held where it was found.
        self.parameter(name).filter(|_| !self.in_stairs(name)).map_or(
            Free { start, bounds: (start, start), scale: 1.0 },
            |parameter| Free { start, bounds: parameter.bounds, scale: typical(parameter) },
        )
    }
}

/// The size a parameter typically has.
fn typical(parameter: &EffectParameter) -> f64 {
    let largest = parameter.starts.iter().fold(0.0, |largest: f64, start| largest.max(start.abs()));
    if largest > 0.0 { largest } else { 0.1 }
}

/// How far the base's own parameters may move in a fit.
fn base_free(name: &str, start: f64) -> Free {
    let bounds = match name {
        // Faster than a sample, or slower than a log, no fit can see.
        "pole" => (0.05, 400.0),
        "inertia" => (1e-4 * start, 1e4 * start),
        "voltage_gain" => (-1e3, 1e3),
        _ => (-1e6, 1e6),
    };
    Free { start, bounds, scale: start.abs().max(1e-9) }
}

#[cfg(test)]
mod tests;
