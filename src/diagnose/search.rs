//! The search of one block: forward, several sets abreast, dropping one out, everything refitted each time.

use super::candidate::Plan;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::model_selection::{
    gains, is_sound, joint_floors, loss, nearest, over_floor, period, same_set, steps, weigh,
};
use super::parallel::{run_promising, run_singles, spread};
use super::search_result::{AT_FLOOR, Found, Single};
use super::surrogate_test::luck;
use super::verdict::stands;
use crate::estimation::noise_floor::floors;
use crate::model::{Effect, Model};

/// Sets carried on abreast: single effects, and sets of two and more. What several known laws approach together from
/// several sides is mostly none of them.
const ABREAST: (usize, usize) = (3, 2);
/// Candidates that are followed for a while beside each set of two or more, the most promising ones. Beside a single
/// effect all are: a law in a corner, such as a limit, looks like nothing for its first steps.
/// And those of a depth that are fitted to the end after that.
const PAIRS: (usize, usize) = (usize::MAX, 8);
const MORE: (usize, usize) = (8, 4);
/// Most effects of one block.
const DEEPEST: usize = 5;
/// Below this factor two effects that are nothing one by one are not looked for.
const NEARLY: f64 = 1.06;
/// Below this factor no further effect is looked for.
const DONE: f64 = 1.03;
/// A body whose error is this many noise floors, where one more effect than before left more than this share of it, has
/// something else on it: a further effect would bend a curve to the data.
const FAR: (f64, f64) = (2.0, 0.8);

/// A search under way.
pub struct Search<'a> {
    /// The base.
    pub base: &'a Model,
    /// Every effect there is.
    pub known: &'a [Effect],
    /// Those that this block and these logs can judge, and why the others cannot be.
    pub eligible: Vec<(&'a Effect, Option<String>)>,
    /// Told after each trial.
    pub done: &'a (dyn Fn() + Sync),
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
        let trials = run_singles(&plans, stage, self.done);
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

    /// Carries the best sets on, one effect deeper each time, until nothing is left to explain.
    pub(crate) fn deepen(
        &self,
        stage: &Stage,
        base: &[String],
        recalibrated: &Trial,
        trials: &mut Vec<Trial>,
    ) {
        let candidates = self.candidates();
        let mut before = recalibrated.clone();
        let mut left = f64::INFINITY;
        for depth in 1..DEEPEST {
            let sound = self.sound(stage, trials, depth);
            let paying: Vec<&Trial> =
                sound.iter().copied().filter(|trial| gains(stage, &before, trial)).collect();
            let falls = !paying.is_empty();
            // Alone no effect may be worth its place, and two together may be.
            let front = if falls { &paying } else { &sound };
            let Some(best) = front.first().map(|best| (*best).clone()) else { return };
            let floors = floors(&stage.validate, &best.judged.residuals, best.model.body.inertia);
            let nearest = over_floor(stage, if falls { &best } else { &before }, &floors).0;
            if nearest < DONE || (!falls && (depth > 1 || nearest < NEARLY)) {
                return;
            }
            let is_in_vain = depth > 1 && nearest > FAR.0 && nearest > FAR.1 * left;
            if is_in_vain && !stage.train.is_rotor() {
                return;
            }
            left = nearest;
            // Beside one that leaves next to nothing the others are only longer ways.
            let abreast = match depth {
                _ if falls && nearest < AT_FLOOR => 1,
                1 => ABREAST.0,
                _ => ABREAST.1,
            };
            let front: Vec<Trial> = front.iter().take(abreast).map(|it| (*it).clone()).collect();
            let mut sets: Vec<Vec<String>> = Vec::new();
            let mut groups: Vec<Vec<Plan>> = Vec::new();
            for trial in &front {
                let mut plans = Vec::new();
                for effect in &candidates {
                    let mut set = trial.effects.clone();
                    set.push(effect.id.clone());
                    let mut sorted = set.clone();
                    sorted.sort();
                    let is_known = || trials.iter().any(|known| same_set(&known.effects, &set));
                    if trial.effects.contains(&effect.id) || sets.contains(&sorted) || is_known() {
                        continue;
                    }
                    sets.push(sorted);
                    let mut effects: Vec<&Effect> =
                        self.known.iter().filter(|known| trial.effects.contains(&known.id)).collect();
                    effects.sort_by_key(|known| trial.effects.iter().position(|id| *id == known.id));
                    effects.push(effect);
                    let without = Some(trial.fit.cost);
                    plans.push(Plan { effects, without, ..self.start(&trial.model, base) });
                }
                groups.push(plans);
            }
            let deeper = run_promising(&groups, if depth == 1 { PAIRS } else { MORE }, stage, self.done);
            trials.extend(deeper);
            before = best;
        }
    }

    /// The sets of a depth whose effects are determined and do not cancel each other, best first.
    fn sound<'t>(&self, stage: &Stage, trials: &'t [Trial], depth: usize) -> Vec<&'t Trial> {
        let of_depth = trials.iter().filter(|trial| trial.effects.len() == depth);
        let mut sound: Vec<&Trial> = of_depth.filter(|trial| is_sound(stage, trial, self.known)).collect();
        sound.sort_by(|a, b| a.validate(stage).total_cmp(&b.validate(stage)));
        sound
    }

    /// The smallest set that no larger one beats.
    pub(crate) fn climb(&self, stage: &Stage, recalibrated: &Trial, trials: &[Trial]) -> Trial {
        // Two effects may be worth nothing one by one: each depth is held against the answer so far.
        self.climb_from(stage, recalibrated.clone(), trials)
    }

    /// The smallest set that holds all of `answer` and that no larger one beats.
    fn climb_from(&self, stage: &Stage, mut answer: Trial, trials: &[Trial]) -> Trial {
        let first = answer.effects.clone();
        let goes_on = |trial: &&Trial| first.iter().all(|id| trial.effects.contains(id));
        for depth in first.len() + 1..=DEEPEST {
            let sound = self.sound(stage, trials, depth).into_iter().filter(goes_on);
            let best = sound.into_iter().find(|it| gains(stage, &answer, it));
            if let Some(best) = best {
                answer = best.clone();
            }
        }
        answer
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

    /// Drops one out until each that stays is worth its place; the sets without each of those.
    fn drop_idle(
        &self,
        stage: &Stage,
        best: &mut Trial,
        base: &[String],
        recalibrated: &Trial,
        trials: &mut [Trial],
    ) -> Vec<Trial> {
        loop {
            let dropped = self.each_dropped(stage, best, base, recalibrated, trials);
            let idle = dropped.iter().filter(|without| !gains(stage, without, best));
            let Some(without) = idle.min_by(|a, b| a.validate(stage).total_cmp(&b.validate(stage))) else {
                return dropped;
            };
            *best = without.clone();
        }
    }

    /// For each effect of `best` the set without it; `trials` learn of it where it is better than what they had.
    fn each_dropped(
        &self,
        stage: &Stage,
        best: &Trial,
        base: &[String],
        recalibrated: &Trial,
        trials: &mut [Trial],
    ) -> Vec<Trial> {
        let dropped = spread(&best.effects, |id| self.without(stage, (best, id), base, recalibrated, trials));
        for without in &dropped {
            if let Some(known) = trials.iter_mut().find(|trial| same_set(&trial.effects, &without.effects)) {
                known.clone_from(without);
            }
        }
        dropped
    }

    fn without(
        &self,
        stage: &Stage,
        (best, id): (&Trial, &str),
        base: &[String],
        recalibrated: &Trial,
        trials: &[Trial],
    ) -> Trial {
        if best.effects.len() == 1 {
            return recalibrated.clone();
        }
        let left: Vec<String> = best.effects.iter().filter(|other| *other != id).cloned().collect();
        let known = trials.iter().find(|trial| same_set(&trial.effects, &left));
        if let Some(known) = known.filter(|known| !gains(stage, known, best)) {
            return known.clone();
        }
        // A fit of the smaller set may have ended on its way: an effect must be worth more than a better start.
        let model = best.model.without(id);
        let again = self.plan(&model, &left, base).run(stage);
        known.filter(|known| known.fit.cost <= again.fit.cost).cloned().unwrap_or(again)
    }

    pub(crate) fn plan<'b>(&'b self, from: &'b Model, effects: &[String], base: &[String]) -> Plan<'b> {
        Plan { effects: self.lookup(effects), ..self.start(from, base) }
    }

    pub(crate) fn start<'b>(&'b self, from: &'b Model, base: &[String]) -> Plan<'b> {
        let base = base.to_vec();
        Plan { from, effects: Vec::new(), base, known: self.known, home: self.base, without: None }
    }

    /// The answer with each effect exchanged for those its card says it is confused with.
    fn swaps(&self, stage: &Stage, best: &Trial, trials: &[Trial], base: &[String]) -> Vec<Trial> {
        if best.effects.len() < 2 {
            return Vec::new();
        }
        let candidates = self.candidates();
        let mut models = Vec::new();
        for id in &best.effects {
            let confused = self.known.iter().find(|effect| effect.id == *id).and_then(|effect| effect.card);
            for other in confused.map_or(&[][..], |card| card.confused_with) {
                let set: Vec<String> = best
                    .effects
                    .iter()
                    .map(|kept| if kept == id { (*other).to_owned() } else { kept.clone() })
                    .collect();
                let may = candidates.iter().any(|effect| effect.id == *other)
                    && !best.effects.iter().any(|kept| kept == other);
                if may && !trials.iter().any(|trial| same_set(&trial.effects, &set)) {
                    models.push((best.model.without(id), set));
                }
            }
        }
        let plans = models.iter().map(|(model, set)| self.plan(model, set, base)).collect();
        run_promising(&[plans], (usize::MAX, usize::MAX), stage, self.done)
    }
}
