//! Formulas refitted by output error through the whole simulation, everything else beside them.

use super::law::CandidateLaw;
use super::linear::Numbers;
use super::thresholds::THRESHOLDS;
use crate::diagnose::candidate_fit::CandidateFit;
use crate::diagnose::candidate_set::Candidate;
use crate::diagnose::data_split::DataSplit;
use crate::diagnose::model_selection::{floor, joint_floors, loss, over_floor, shortfall};
use crate::diagnose::problem::Problem;
use crate::diagnose::search_result::SearchResult;
use crate::diagnose::search_space::Search;
use crate::effect::Site;
use crate::model::{Effect, Model};

/// A block in which something is missing, and the fit from which laws start.
#[derive(Clone, Copy)]
pub(crate) struct LawTask<'a> {
    /// The model asked about.
    pub model: &'a Model,
    /// Its effects and the catalogue's.
    pub known: &'a [Effect],
    /// The block, searched.
    pub found: &'a SearchResult,
    /// The block's fit that a law is added to.
    pub start: &'a CandidateFit,
    /// The fit that a law must do better than.
    pub before: &'a CandidateFit,
    /// Id of the law.
    pub id: &'a str,
}

/// A formula after its fit.
#[derive(Debug, Clone)]
pub(crate) struct Formula {
    /// Its inner numbers are those found.
    pub law: CandidateLaw,
    pub fitted: CandidateFit,
}

/// A model that can have a law, and all effects with it.
pub(crate) struct WithLaw {
    base: Model,
    from: Model,
    known: Vec<Effect>,
}

impl WithLaw {
    /// The search in which the law is one of the effects.
    pub fn search(&self) -> Search<'_> {
        Search { base: &self.base, known: &self.known, eligible: Vec::new(), progress: &|_| () }
    }

    /// The model that the law is added to, its own numbers at those of the values that are nearest to the data with the law.
    fn nearest(&self, task: &LawTask, numbers: &[Numbers]) -> Model {
        let at = |numbers: &Numbers| {
            let mut model = self.from.clone();
            numbers.iter().for_each(|(name, value)| model.set_parameter(name, *value));
            model
        };
        let cost = |model: &Model| {
            let with = self.known.last().map_or_else(|| model.clone(), |law| model.with(law));
            let inside: Vec<&Effect> = self.known.iter().filter(|effect| with.has(&effect.id)).collect();
            let cost = Problem::new(&task.split().train, with.clone(), Vec::new(), &inside).cost_of(&with);
            if cost.is_finite() { cost } else { f64::INFINITY }
        };
        let mut models: Vec<Model> = numbers.iter().map(at).collect();
        models.push(self.from.clone());
        let costs: Vec<f64> = models.iter().map(cost).collect();
        let best = (0..models.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        best.map_or_else(|| self.from.clone(), |index| models.swap_remove(index))
    }
}

impl<'a> LawTask<'a> {
    pub fn split(&self) -> &'a DataSplit {
        &self.found.split
    }

    /// Numbers that are free beside a law: the base's, and those of the effects that it is added to.
    pub fn free_names(&self) -> Vec<String> {
        let mut names = self.split().base_parameters(self.model);
        let model = &self.start.model;
        let of_effect = |effect: &&Effect| self.start.effects.contains(&effect.id);
        for effect in self.known.iter().filter(of_effect) {
            names.extend(
                effect.parameters.iter().map(|parameter| format!("{}.{}", effect.id, parameter.name)),
            );
        }
        names.retain(|name| model.parameter(name).is_some());
        names
    }

    /// The models with the law known to them, its coefficients to start at these values.
    pub fn with_law(&self, law: &CandidateLaw, coefficients: &[f64]) -> Option<WithLaw> {
        let user = law.user_effect(self.id, coefficients);
        let add = |model: &Model| {
            let mut model = model.clone();
            model.user_effects.push(user.clone());
            model
        };
        let (base, from) = (add(self.model), add(&self.start.model));
        let mut effect = base.effect(self.id).ok()?;
        // The search knows where it starts.
        effect.parameters.iter_mut().for_each(|parameter| parameter.starts.truncate(1));
        let known = [self.known, &[effect]].concat();
        Some(WithLaw { base, from, known })
    }

    /// The law beside everything else, refitted through the simulation, from the best of these values of the model's own numbers and
    /// those of the start.
    pub fn refit(&self, law: &CandidateLaw, coefficients: &[f64], numbers: &[Numbers]) -> Option<Formula> {
        let models = self.with_law(law, coefficients)?;
        let search = models.search();
        let base_names = self.split().base_parameters(self.model);
        let ids: Vec<String> = self.start.effects.iter().cloned().chain([self.id.to_owned()]).collect();
        let from = models.nearest(self, numbers);
        let candidate = search.candidate(&from, &ids, &base_names);
        let fitted = Candidate { without: Some(self.before.fit.cost), ..candidate }.run(self.split());
        let law = law.at(&fitted.model, self.id);
        fitted.held_out.cost.is_finite().then_some(Formula { law, fitted })
    }

    /// Squared error on all data.
    pub fn loss(&self, fitted: &CandidateFit) -> f64 {
        loss(self.split(), fitted)
    }

    /// Held-out error over the noise that it leaves itself, in the worst channel.
    pub fn over_floor(&self, fitted: &CandidateFit) -> f64 {
        over_floor(self.split(), fitted, &joint_floors(self.split(), fitted)).0
    }

    /// Share of the held-out squared error above the noise that a fit takes off what there was before.
    pub fn explained(&self, fitted: &CandidateFit) -> f64 {
        let split = self.split();
        let (before, after) = (self.before.validate(split), fitted.validate(split));
        let room = before - floor(split, &joint_floors(split, fitted));
        if room > 0.0 { ((before - after) / room).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Whether a formula gains enough over `before` for how many were tried: by diagnose's conditions, and a larger share.
    pub fn gains(&self, before: &CandidateFit, after: &CandidateFit) -> bool {
        let split = self.split();
        let share = 1.0 - after.validate(split) / before.validate(split);
        share > THRESHOLDS.term_gain && shortfall(split, before, after).is_none()
    }

    /// Whether each of a formula's coefficients differs from none, and no size in it is as large as it may be: then the formula is
    /// another one, of which the data show the beginning.
    pub fn is_determined(&self, formula: &Formula) -> bool {
        let model = &formula.fitted.model;
        let mut inner = formula.law.terms.iter().flat_map(|term| &term.inner);
        if inner.any(|it| it.is_size() && it.value > THRESHOLDS.at_bound * it.bounds.1) {
            return false;
        }
        let differs = |name: &String| {
            let name = format!("{}.{name}", self.id);
            match (model.parameter(&name), model.standard_errors.get(&name)) {
                (Some(value), Some(error)) => value.abs() > THRESHOLDS.coefficient * error,
                _ => false,
            }
        };
        let names = formula.law.coefficient_names();
        // Of a wave the two parts are one: its phase may be any.
        let mut from = 0;
        formula.law.terms.iter().all(|term| {
            let own = &names[from..from + term.parts.len()];
            from += term.parts.len();
            own.iter().any(differs)
        })
    }

    /// Share of the squared error within which formulas are the same to these data.
    pub fn tolerance(&self, best: &CandidateFit) -> f64 {
        let split = self.split();
        let noise = floor(split, &joint_floors(split, best)) / best.validate(split);
        THRESHOLDS.same_error
            + crate::diagnose::thresholds::THRESHOLDS.indistinguishable_share * (1.0 - noise.clamp(0.0, 1.0))
    }
}

/// The formula of least numbers among those that are the same to the data as the best one, and the others of these.
pub(crate) fn simplest(task: &LawTask, mut formulas: Vec<Formula>) -> Option<(Formula, Vec<Formula>)> {
    formulas.retain(|formula| task.is_determined(formula));
    let loss = |formula: &Formula| task.loss(&formula.fitted);
    formulas.sort_by(|a, b| loss(a).total_cmp(&loss(b)));
    let best = formulas.first()?.clone();
    let limit = loss(&best) * (1.0 + task.tolerance(&best.fitted));
    // At another place it is another claim: there it must not be beaten from stretch to stretch, however little.
    let is_beaten = |formula: &Formula| {
        !formula.law.shares_place(&best.law)
            && formula.fitted.consistency(&best.fitted) > THRESHOLDS.steadily_better
    };
    formulas.retain(|formula| loss(formula) <= limit && !is_beaten(formula));
    // As many numbers: what fits better. One more number must show.
    let order = |formula: &Formula| (formula.law.numbers(), formula.law.channels().len());
    let least = |formulas: &[Formula], is_asked: &dyn Fn(&CandidateLaw) -> bool| {
        let asked = (0..formulas.len()).filter(|index| is_asked(&formulas[*index].law));
        asked.min_by(|a, b| {
            let (a, b) = (&formulas[*a], &formulas[*b]);
            order(a).cmp(&order(b)).then(loss(a).total_cmp(&loss(b)))
        })
    };
    let mut index = least(&formulas, &|_| true)?;
    // What a body feels by the torque that its rotors make, it feels from them: where thrust does as well, it is the thrust.
    if formulas[index].law.is_by_torque() {
        index = least(&formulas, &|law| law.site == Site::Thrust).unwrap_or(index);
    }
    let simplest = formulas.remove(index);
    Some((simplest, formulas))
}
