//! The search of one block: forward, several sets abreast, dropping one out, everything refitted each time.

use super::candidate::Plan;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::model_selection::{joint_floors, loss, nearest, period, steps, weigh};
use super::parallel::run_singles;
use super::progress::Event;
use super::search_result::{Found, Single};
use super::surrogate_test::{Luck, luck};
use super::verdict::stands;
use crate::model::{Effect, Model};

/// A search under way.
pub struct Search<'a> {
    /// The base.
    pub base: &'a Model,
    /// Every effect there is.
    pub known: &'a [Effect],
    /// Those that this block and these logs can judge, and why the others cannot be.
    pub eligible: Vec<(&'a Effect, Option<String>)>,
    /// Hears how far it is.
    pub progress: &'a (dyn Fn(Event) + Sync),
}

impl<'a> Search<'a> {
    /// Searches one block.
    #[must_use]
    pub fn run(&self, mut stage: Stage) -> Found {
        let base_names = stage.base_parameters(self.base);
        let (stale, recalibrated) = self.bases(&mut stage);
        if stands(&stage, &stale, &recalibrated) {
            return self.unmoved(stage, stale, recalibrated);
        }
        let singles = self.singles(&stage, &recalibrated, &base_names);
        let trials: Vec<Trial> = singles.iter().filter_map(|single| single.trial.clone()).collect();
        self.among(stage, (stale, recalibrated), singles, trials)
    }

    /// What is found of a body that does not move, whatever the torque on it: nothing can be, and nothing is looked for.
    fn unmoved(&self, stage: Stage, stale: Trial, recalibrated: Trial) -> Found {
        let note = "the body does not move, whatever the torque on it";
        let single = |(effect, why): &(&Effect, Option<String>)| Single {
            effect: effect.id.clone(),
            trial: None,
            luck: None,
            note: why.clone().unwrap_or_else(|| note.to_owned()),
        };
        Found {
            singles: self.eligible.iter().map(single).collect(),
            floors: joint_floors(&stage, &stale),
            answer: stale.clone(),
            ladder: vec![recalibrated.clone()],
            alternatives: Vec::new(),
            dropped: Vec::new(),
            changed: Vec::new(),
            stage,
            stale,
            recalibrated,
        }
    }

    /// The answer among the sets tried, and those that they lead to. Again without them where laws that read the battery are
    /// part of it by luck.
    fn among(
        &self,
        stage: Stage,
        bases: (Trial, Trial),
        singles: Vec<Single>,
        mut trials: Vec<Trial>,
    ) -> Found {
        self.deepen(&stage, &stage.base_parameters(self.base), &bases.1, &mut trials);
        let best = self.climb(&stage, &bases.1, &trials);
        let mut found = self.conclude(stage, bases, singles, &mut trials, best);
        let Some((chance, ids)) = self.battery_luck(&found) else { return found };
        trials.retain(|trial| !trial.effects.iter().any(|id| ids.contains(id)));
        let mut eligible = self.eligible.clone();
        let note = "the battery's reading, shifted in time, does as well";
        for (_, why) in eligible.iter_mut().filter(|(effect, _)| ids.contains(&effect.id)) {
            *why = Some(note.to_owned());
        }
        for single in found.singles.iter_mut().filter(|single| ids.contains(&single.effect)) {
            single.luck = single.luck.map(|luck| Luck { chance: luck.chance.max(chance), ..luck });
            single.note = note.to_owned();
        }
        let Found { stage, stale, recalibrated, singles, .. } = found;
        Search { eligible, ..*self }.among(stage, (stale, recalibrated), singles, trials)
    }

    pub(crate) fn lookup(&self, ids: &[String]) -> Vec<&'a Effect> {
        ids.iter().filter_map(|id| self.known.iter().find(|effect| effect.id == *id)).collect()
    }

    pub(crate) fn candidates(&self) -> Vec<&'a Effect> {
        self.eligible.iter().filter(|(_, why)| why.is_none()).map(|(effect, _)| *effect).collect()
    }

    fn singles(&self, stage: &Stage, recalibrated: &Trial, base: &[String]) -> Vec<Single> {
        let candidates = self.candidates();
        let plans: Vec<Plan> = candidates
            .iter()
            .map(|effect| Plan {
                effects: vec![*effect],
                without: Some(recalibrated.fit.cost),
                ..self.start(&recalibrated.model, base)
            })
            .collect();
        let trials = run_singles(&plans, stage, self.progress);
        let tried = candidates.iter().zip(trials).map(|(effect, trial)| Single {
            effect: effect.id.clone(),
            luck: Some(luck(recalibrated, &trial, period(stage))),
            trial: Some(trial),
            note: String::new(),
        });
        let refused = self.eligible.iter().filter_map(|(effect, why)| {
            let note = why.clone()?;
            Some(Single { effect: effect.id.clone(), trial: None, luck: None, note })
        });
        tried.chain(refused).collect()
    }

    pub(crate) fn conclude(
        &self,
        stage: Stage,
        (stale, recalibrated): (Trial, Trial),
        singles: Vec<Single>,
        trials: &mut Vec<Trial>,
        mut best: Trial,
    ) -> Found {
        let base_names = stage.base_parameters(self.base);
        let mut dropped = self.drop_idle(&stage, &mut best, &base_names, &recalibrated, trials);
        let swapped = self.swaps(&stage, &best, trials, &base_names);
        trials.extend(swapped);
        if let Some(better) = nearest(&stage, &best, trials, self.known)
            .first()
            .filter(|trial| loss(&stage, trial) < loss(&stage, &best))
        {
            // What goes on from it may have been passed over with it: a law that shows in one stretch gains nothing by itself.
            let size = better.effects.len();
            best = self.climb_from(&stage, better.clone(), trials);
            dropped = if best.effects.len() > size {
                self.drop_idle(&stage, &mut best, &base_names, &recalibrated, trials)
            } else {
                self.each_dropped(&stage, &best, &base_names, &recalibrated, trials)
            };
        }
        let mut alternatives = nearest(&stage, &best, trials, self.known);
        let mut ladder = vec![recalibrated.clone()];
        ladder.extend(steps(&stage, &best, trials));
        let (mut answer, mut changed) = self.settle(&stage, &stale, &recalibrated, &best);
        let unexplained_change = best.effects.is_empty() && !changed.is_empty();
        let instead =
            unexplained_change.then(|| self.instead_of_change(&stage, &answer, changed.len())).flatten();
        if let Some((effect, twins)) = instead {
            alternatives = twins;
            (best, answer, changed) = (effect.clone(), effect, Vec::new());
            dropped = vec![recalibrated.clone()];
            ladder.push(answer.clone());
        }
        if !best.effects.is_empty() {
            ladder.pop();
            ladder.push(answer.clone());
        }
        let floors = joint_floors(&stage, &answer);
        Found { stage, stale, recalibrated, singles, answer, ladder, alternatives, dropped, floors, changed }
    }

    /// The base as it is and recalibrated; the stage learns how large its noise is.
    pub(crate) fn bases(&self, stage: &mut Stage) -> (Trial, Trial) {
        let base_names = stage.base_parameters(self.base);
        let first = self.plan(self.base, &[], &base_names).run(stage);
        weigh(stage, &first);
        (self.plan(self.base, &[], &[]).run(stage), self.plan(self.base, &[], &base_names).run(stage))
    }

    pub(crate) fn plan<'b>(&'b self, from: &'b Model, effects: &[String], base: &[String]) -> Plan<'b> {
        Plan { effects: self.lookup(effects), ..self.start(from, base) }
    }

    pub(crate) fn start<'b>(&'b self, from: &'b Model, base: &[String]) -> Plan<'b> {
        let base = base.to_vec();
        Plan { from, effects: Vec::new(), base, known: self.known, home: self.base, without: None }
    }
}
