//! Parameter subset selection: of the base's own numbers only those are changed that the answer needs; and one effect instead of
//! changed numbers.

use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::model_selection::{improves, indistinguishable, is_identifiable};
use super::parallel::run_all;
use super::search_space::Search;
use super::thresholds::THRESHOLDS;
use crate::model::{Effect, Model};

impl<'a> Search<'a> {
    /// One effect on the base as it was, where it does better than changed numbers of the base, or as well as
    /// several of them: numbers that all moved at once are less likely than one effect. And those that are indistinguishable from it.
    pub(crate) fn single_effect_instead(
        &self,
        split: &DataSplit,
        changed: &CandidateFit,
        count: usize,
    ) -> Option<(CandidateFit, Vec<CandidateFit>)> {
        let admitted = self.admitted();
        // A fit that stays far above the changed numbers' is given up.
        let without = Some(THRESHOLDS.given_up * changed.fit.cost);
        let candidate =
            |effect: &&'a Effect| Candidate { effects: vec![*effect], without, ..self.start(self.base, &[]) };
        let candidates: Vec<Candidate> = admitted.iter().map(candidate).collect();
        let fits = run_all(&candidates, split, self.progress);
        let identifiable = fits.iter().filter(|fitted| is_identifiable(split, fitted, self.known));
        let best = identifiable.min_by(|a, b| a.validate(split).total_cmp(&b.validate(split)))?.clone();
        let limit =
            if count > 1 { 1.0 + THRESHOLDS.instead_of_several } else { 1.0 - THRESHOLDS.instead_of_one };
        let is_better = !changed.is_exact(split) && best.validate(split) < limit * changed.validate(split);
        is_better.then(|| {
            let as_good = indistinguishable(split, &best, &fits, self.known);
            (best, as_good)
        })
    }

    /// A model with the base's numbers as they were, and the effects' as they were found.
    fn with_own_numbers(&self, found: &Model, names: &[String]) -> Model {
        let mut model = found.clone();
        for name in names {
            if let Some(value) = self.base.parameter(name) {
                model.set_parameter(name, value);
            }
            model.standard_errors.remove(name);
        }
        model
    }

    /// The effects of `best` with as few changed base parameters as do as well, found forwards from the base as it
    /// was: a parameter that is refitted for nothing only brings its noise along.
    pub(crate) fn select_parameters(
        &self,
        split: &DataSplit,
        nominal: &CandidateFit,
        refitted: &CandidateFit,
        best: &CandidateFit,
    ) -> (CandidateFit, Vec<String>) {
        if best.effects.is_empty() {
            return self.select_from(split, nominal.clone(), refitted.clone(), &best.model);
        }
        self.select_beside_effects(split, best.clone())
    }

    /// The same of a set of effects.
    pub(crate) fn select_beside_effects(
        &self,
        split: &DataSplit,
        best: CandidateFit,
    ) -> (CandidateFit, Vec<String>) {
        let names = split.base_parameters(self.base);
        let model = self.with_own_numbers(&best.model, &names);
        let now = Candidate { effects: self.lookup(&best.effects), ..self.start(&model, &[]) }.run(split);
        self.select_from(split, now, best, &model)
    }

    /// The same from a fit with the base's numbers as they were towards one with all of them free, with the numbers of the effects of
    /// `target` as `found` has them.
    fn select_from(
        &self,
        split: &DataSplit,
        mut now: CandidateFit,
        target: CandidateFit,
        found: &Model,
    ) -> (CandidateFit, Vec<String>) {
        let names = split.base_parameters(self.base);
        let effects = self.lookup(&target.effects);
        let model = self.with_own_numbers(found, &names);
        let mut free: Vec<String> = Vec::new();
        while free.len() < names.len() {
            // From the base's numbers a better valley may have been found than the one of `best`: then each number has
            // to gain enough by itself.
            let is_behind = improves(split, &now, &target);
            let is_ahead = target.validate(split) * (1.0 - THRESHOLDS.least_gain) > now.validate(split);
            if !is_behind && !is_ahead {
                break;
            }
            let left: Vec<&String> = names.iter().filter(|name| !free.contains(name)).collect();
            let candidate = |name: &&String| Candidate {
                effects: effects.clone(),
                base: free.iter().chain([*name]).cloned().collect(),
                ..self.start(&model, &[])
            };
            let next = run_all(&left.iter().map(candidate).collect::<Vec<Candidate>>(), split, self.progress);
            let best =
                next.into_iter().zip(left).min_by(|a, b| a.0.validate(split).total_cmp(&b.0.validate(split)));
            let Some((fitted, name)) = best else { break };
            if !is_behind && !improves(split, &now, &fitted) {
                break;
            }
            free.push(name.clone());
            now = fitted;
        }
        // Started from the base's numbers a fit can end in another valley, or without one of the effects: then the way
        // there does not count.
        let lost_one = !now.effects.is_empty() && !is_identifiable(split, &now, self.known);
        let behind = target.validate(split) < now.validate(split) * (1.0 - THRESHOLDS.least_gain);
        if lost_one || (behind && !now.is_exact(split)) { (target, names) } else { (now, free) }
    }
}
