//! Where the fit of a candidate starts: from the model it goes out from and from its base as it was, with each value that the card
//! of a fresh effect names or a scan finds.

use super::candidate::StartingPoint;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::grid_search;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::effect::Term;
use crate::estimation::output_error::{Free, fit_best};
use crate::model::{Effect, EffectParameter, Model};

impl Candidate<'_> {
    /// The models from which a fit of the fresh effects may start.
    pub(crate) fn starts(&self, template: &Model, fresh: &[&Effect], split: &DataSplit) -> Vec<Model> {
        let mut starts = vec![template.clone()];
        for effect in fresh {
            for parameter in &effect.parameters {
                let name = format!("{}.{}", effect.id, parameter.name);
                let with = |models: &[Model], values: &[f64]| -> Vec<Model> {
                    let pairs =
                        models.iter().flat_map(|model| values.iter().map(move |value| (model, *value)));
                    let with = |(model, value): (&Model, f64)| {
                        let mut other = model.clone();
                        other.set_parameter(&name, value);
                        other
                    };
                    pairs.map(with).collect()
                };
                let others = if self.is_discontinuous(&name) {
                    self.on_grids(&starts, template, (&name, parameter.bounds), split)
                } else {
                    let values: Vec<f64> = parameter.starts.iter().skip(1).copied().collect();
                    with(&starts, &values)
                };
                if self.is_discontinuous(&name) && !others.is_empty() {
                    let finest = grid_search::finest(&split.train);
                    starts.retain(|model| model.parameter(&name).is_none_or(|step| step >= finest));
                }
                // Where a grid puts the number ahead of it, the card's values of that are one.
                for other in others {
                    if !starts.contains(&other) {
                        starts.push(other);
                    }
                }
            }
        }
        starts.truncate(THRESHOLDS.most_starts);
        if self.has_moved(template, THRESHOLDS.moved_base) {
            let with_nominal_base: Vec<Model> =
                starts.iter().map(|model| self.with_nominal_base(model)).collect();
            starts.extend(with_nominal_base);
        }
        starts
    }

    /// Starts with each grid that a look at all of them finds promising, and where a law ahead of it puts the grid.
    fn on_grids(
        &self,
        starts: &[Model],
        template: &Model,
        (name, bounds): (&str, (f64, f64)),
        split: &DataSplit,
    ) -> Vec<Model> {
        let inside = self.inside(template);
        let names = self.names_in(&inside, split.train.is_rotor());
        let beside = self.beside_grid(&names, template);
        let named = (name, names.iter().find(|it| self.is_ahead_of_grid(it, template)).map(String::as_str));
        let with = |starts: &[Model], template: &Model| -> Vec<Model> {
            let grids = grid_search::grids(&split.train, template, named, bounds, (&inside, &beside));
            let put = |(model, grid): (&Model, &grid_search::Grid)| {
                let mut model = model.clone();
                grid.put_into(&mut model, named);
                model
            };
            starts.iter().flat_map(|model| grids.iter().map(move |grid| (model, grid))).map(put).collect()
        };
        let mut others = with(starts, template);
        // Fitted without the grid, the base has bent after it.
        if self.has_moved(template, THRESHOLDS.moved_base_for_grid) {
            let with_nominal_base: Vec<Model> =
                starts.iter().map(|model| self.with_nominal_base(model)).collect();
            others.extend(with(&with_nominal_base, &self.with_nominal_base(template)));
        }
        others
    }

    /// A few steps from each start, on a part of the data; best first.
    pub(crate) fn ranked_starts(
        &self,
        starts: Vec<Model>,
        names: &[String],
        split: &DataSplit,
    ) -> Vec<StartingPoint> {
        let Some(first) = starts.first() else { return Vec::new() };
        let data = split.coarse.as_ref().unwrap_or(&split.train);
        let problem = Problem::new(data, first.clone(), names.to_vec(), &self.inside(first));
        let from = |model: &Model| self.frees(names, &self.weakened(model, &problem));
        let starts: Vec<Vec<Free>> = starts.iter().map(from).collect();
        // What is found of single effects decides which sets are looked at: on a slow ramp the right start is not yet to be seen then.
        let most = if self.effects.len() > 1 { THRESHOLDS.starts_followed } else { starts.len() };
        let ends = fit_best(&problem, &starts, &THRESHOLDS.start_fit, most);
        ends.into_iter().map(|end| StartingPoint::at_end(end, &problem, split.coarse.is_none())).collect()
    }

    /// A start whose effects are weak enough for this bench: what is little on one bench is absurd on another that turns
    /// five times as fast, and from an absurd start no slope leads home.
    fn weakened(&self, start: &Model, problem: &Problem) -> Model {
        let cost = |model: &Model| problem.cost_of(model);
        let without = self.weaker(start, 0.0);
        if without == *start {
            return without;
        }
        let limit = THRESHOLDS.too_strong_start * cost(&without);
        let mut weakened = start.clone();
        for _ in 0..THRESHOLDS.most_weakenings {
            // Not a number is no start either.
            if cost(&weakened) <= limit {
                break;
            }
            weakened = self.weaker(&weakened, THRESHOLDS.weakening);
        }
        weakened
    }

    /// A model whose fresh effects have this share of what they are there.
    fn weaker(&self, model: &Model, share: f64) -> Model {
        let mut weaker = model.clone();
        for effect in self.effects.iter().filter(|effect| !self.from.has(&effect.id)) {
            for parameter in effect.parameters.iter().filter(|parameter| parameter.neutral.is_finite()) {
                let name = format!("{}.{}", effect.id, parameter.name);
                if let Some(value) = model.parameter(&name) {
                    weaker.set_parameter(&name, parameter.neutral + share * (value - parameter.neutral));
                }
            }
        }
        weaker
    }

    /// Where a fit starts of one fresh effect that is faint, if there at all: near none a law is a straight line in its size, and the
    /// size of a start does not matter. Of a limit it does: beyond all commands it has no slope.
    pub(crate) fn faint_starts(&self, effect: &Effect, template: &Model, split: &DataSplit) -> Vec<Model> {
        let is_size = |parameter: &EffectParameter| parameter.neutral.is_finite();
        if effect.card.is_some_and(|card| card.acts_as == Some(Term::Saturation)) {
            return self.starts(template, &[effect], split);
        }
        let starts = match effect.parameters.as_slice() {
            [size] if is_size(size) => vec![template.clone()],
            _ => self.starts(template, &[effect], split),
        };
        starts.iter().map(|start| self.weaker(start, THRESHOLDS.faint)).collect()
    }

    /// Whether a free base number is further from where it was than this share of it.
    fn has_moved(&self, model: &Model, share: f64) -> bool {
        self.base.iter().any(|name| match (model.parameter(name), self.nominal.parameter(name)) {
            (Some(now), Some(nominal)) => (now - nominal).abs() > share * nominal.abs(),
            _ => false,
        })
    }

    /// The model with its free base numbers where they were.
    fn with_nominal_base(&self, model: &Model) -> Model {
        let mut nominal = model.clone();
        for name in &self.base {
            if let Some(value) = self.nominal.parameter(name) {
                nominal.set_parameter(name, value);
            }
        }
        nominal
    }
}
