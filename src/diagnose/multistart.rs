//! Where the fit of a trial starts: from the model it goes out from and from its base as it was, with each value that the card
//! of a fresh effect names or a scan finds.

use super::candidate::Plan;
use super::data_split::Stage;
use super::grid_search;
use super::problem::Problem;
use crate::estimation::output_error::{FitConfig, fit};
use crate::model::{Effect, Model};

/// Steps of the first look at each start.
const LOOK: FitConfig = FitConfig { iterations: 4, tolerance: 1e-3, goal: None, goes_on: true };
/// Most starts of one trial, from the same base numbers.
const MOST_STARTS: usize = 12;
/// A start that costs so many times what it costs without the effect is too strong.
const ABSURD: f64 = 4.0;
/// How often such a start is made weaker, to a fifth each time.
const MOST_TAMINGS: usize = 6;
/// A base number refitted by more than this share may have been driven into another valley by what is missing.
const STRAYED: f64 = 0.25;
/// Moved by more than this share, they hide where the steps of a grid are: a step is a few rad/s.
const MOVED: f64 = 0.002;

impl Plan<'_> {
    /// The models from which a fit of the fresh effects may start.
    pub(crate) fn starts(&self, template: &Model, fresh: &[&Effect], stage: &Stage) -> Vec<Model> {
        let inside = self.inside(template);
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
                let others = if self.in_stairs(&name) {
                    let scanned = |model: &Model| {
                        grid_search::values(&stage.train, model, &name, parameter.bounds, &inside)
                    };
                    let mut others = with(&starts, &scanned(template));
                    // Fitted without the grid, the base has bent after it.
                    if self.strayed(template, MOVED) {
                        let at_home: Vec<Model> = starts.iter().map(|model| self.at_home(model)).collect();
                        others.extend(with(&at_home, &scanned(&self.at_home(template))));
                    }
                    others
                } else {
                    let values: Vec<f64> = parameter.starts.iter().skip(1).copied().collect();
                    with(&starts, &values)
                };
                starts.extend(others);
            }
        }
        starts.truncate(MOST_STARTS);
        if self.strayed(template, STRAYED) {
            let at_home: Vec<Model> = starts.iter().map(|model| self.at_home(model)).collect();
            starts.extend(at_home);
        }
        starts
    }

    /// A few steps from each start, on a part of the data; best first.
    pub(crate) fn looked_at(&self, starts: Vec<Model>, names: &[String], stage: &Stage) -> Vec<(f64, Model)> {
        let Some(first) = starts.first() else { return Vec::new() };
        let data = stage.coarse.as_ref().unwrap_or(&stage.train);
        let problem = Problem::new(data, first.clone(), names.to_vec(), &self.inside(first));
        let look = |model: &Model| {
            let model = &self.tamed(model, &problem);
            let look = fit(&problem, &self.frees(names, model), None, &LOOK);
            (look.cost, problem.model(&look.globals))
        };
        let mut looks: Vec<(f64, Model)> = starts.iter().map(look).collect();
        looks.sort_by(|a, b| a.0.total_cmp(&b.0));
        looks
    }

    /// A start whose effects are weak enough for this bench: what is little on one bench is absurd on another that turns
    /// five times as fast, and from an absurd start no slope leads home.
    fn tamed(&self, start: &Model, problem: &Problem) -> Model {
        let cost = |model: &Model| problem.cost_of(model);
        let weaker = |model: &Model, share: f64| {
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
        };
        let limit = ABSURD * cost(&weaker(start, 0.0));
        let mut tamed = start.clone();
        for _ in 0..MOST_TAMINGS {
            // Not a number is no start either.
            if cost(&tamed) <= limit {
                break;
            }
            tamed = weaker(&tamed, 0.2);
        }
        tamed
    }

    /// Whether a free base number is further from where it was than this share of it.
    fn strayed(&self, model: &Model, share: f64) -> bool {
        self.base.iter().any(|name| match (model.parameter(name), self.home.parameter(name)) {
            (Some(now), Some(home)) => (now - home).abs() > share * home.abs(),
            _ => false,
        })
    }

    /// The model with its free base numbers where they were.
    fn at_home(&self, model: &Model) -> Model {
        let mut home = model.clone();
        for name in &self.base {
            if let Some(value) = self.home.parameter(name) {
                home.set_parameter(name, value);
            }
        }
        home
    }
}
