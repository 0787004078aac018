//! Forwards: sets of effects grow by one at a time, several sets side by side.

use super::candidate::Plan;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::model_selection::{gains, is_sound, over_floor, same_set};
use super::parallel::run_promising;
use super::progress::Event;
use super::search::Search;
use super::search_result::AT_FLOOR;
use crate::estimation::noise_floor::floors;
use crate::model::Effect;

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

impl Search<'_> {
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
            (self.progress)(Event::Leading(&best.effects));
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
            let deeper = run_promising(&groups, if depth == 1 { PAIRS } else { MORE }, stage, self.progress);
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
    pub(crate) fn climb_from(&self, stage: &Stage, mut answer: Trial, trials: &[Trial]) -> Trial {
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
}
