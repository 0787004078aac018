//! Of the base's own numbers only those are changed that the answer needs; and one effect instead of changed numbers.

use super::candidate::Plan;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::model_selection::{LEAST_GAIN, gains, is_sound, nearest};
use super::parallel::run_all;
use super::search::Search;
use crate::model::Effect;

/// Times the cost of changed numbers.
const GIVEN_UP: f64 = 1.2;

impl<'a> Search<'a> {
    /// One effect on the base as it was, where it does better than changed numbers of the base, or as well as
    /// several of them: numbers that all moved at once are less likely than one effect. And those that cannot be told from it.
    pub(crate) fn instead_of_change(
        &self,
        stage: &Stage,
        changed: &Trial,
        count: usize,
    ) -> Option<(Trial, Vec<Trial>)> {
        let candidates = self.candidates();
        // A fit that stays far above the changed numbers' is given up.
        let without = Some(GIVEN_UP * changed.fit.cost);
        let plan =
            |effect: &&'a Effect| Plan { effects: vec![*effect], without, ..self.start(self.base, &[]) };
        let plans: Vec<Plan> = candidates.iter().map(plan).collect();
        let trials = run_all(&plans, stage, self.progress);
        let sound = trials.iter().filter(|trial| is_sound(stage, trial, self.known));
        let best = sound.min_by(|a, b| a.validate(stage).total_cmp(&b.validate(stage)))?.clone();
        let limit = if count > 1 { 1.0 + 0.5 * LEAST_GAIN } else { 1.0 - 0.25 * LEAST_GAIN };
        let is_better = !changed.is_exact(stage) && best.validate(stage) < limit * changed.validate(stage);
        is_better.then(|| {
            let twins = nearest(stage, &best, &trials, self.known);
            (best, twins)
        })
    }

    /// The effects of `best` with as few changed base parameters as do as well, found forwards from the base as it
    /// was: a parameter that is refitted for nothing only brings its noise along.
    pub(crate) fn settle(
        &self,
        stage: &Stage,
        stale: &Trial,
        recalibrated: &Trial,
        best: &Trial,
    ) -> (Trial, Vec<String>) {
        let names = stage.base_parameters(self.base);
        let effects = self.lookup(&best.effects);
        // The base's numbers as they were, the effects' as they were found.
        let mut model = best.model.clone();
        for name in &names {
            if let Some(value) = self.base.parameter(name) {
                model.set_parameter(name, value);
            }
            model.standard_errors.remove(name);
        }
        let (mut now, target) = if best.effects.is_empty() {
            (stale.clone(), recalibrated)
        } else {
            (Plan { effects: effects.clone(), ..self.start(&model, &[]) }.run(stage), best)
        };
        let mut free: Vec<String> = Vec::new();
        while free.len() < names.len() {
            // From the base's numbers a better valley may have been found than the one of `best`: then each number has
            // to be worth its change by itself.
            let is_behind = gains(stage, &now, target);
            let is_ahead = target.validate(stage) * (1.0 - LEAST_GAIN) > now.validate(stage);
            if !is_behind && !is_ahead {
                break;
            }
            let left: Vec<&String> = names.iter().filter(|name| !free.contains(name)).collect();
            let plan = |name: &&String| Plan {
                effects: effects.clone(),
                base: free.iter().chain([*name]).cloned().collect(),
                ..self.start(&model, &[])
            };
            let next = run_all(&left.iter().map(plan).collect::<Vec<Plan>>(), stage, self.progress);
            let best =
                next.into_iter().zip(left).min_by(|a, b| a.0.validate(stage).total_cmp(&b.0.validate(stage)));
            let Some((trial, name)) = best else { break };
            if !is_behind && !gains(stage, &now, &trial) {
                break;
            }
            free.push(name.clone());
            now = trial;
        }
        // Started from the base's numbers a fit can end in another valley, or without one of the effects: then the way
        // there does not count.
        let lost_one = !now.effects.is_empty() && !is_sound(stage, &now, self.known);
        let behind = target.validate(stage) < now.validate(stage) * (1.0 - LEAST_GAIN);
        if lost_one || (behind && !now.is_exact(stage)) { (target.clone(), names) } else { (now, free) }
    }
}
