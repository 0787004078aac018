//! Backwards: each effect of an answer left out, or exchanged for one that it is confused with.

use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::model_selection::{gains, same_set};
use super::parallel::{run_promising, spread};
use super::search::Search;

impl Search<'_> {
    /// Drops one out until each that stays is worth its place; the sets without each of those.
    pub(crate) fn drop_idle(
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
    pub(crate) fn each_dropped(
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

    /// The answer with each effect exchanged for those its card says it is confused with.
    pub(crate) fn swaps(&self, stage: &Stage, best: &Trial, trials: &[Trial], base: &[String]) -> Vec<Trial> {
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
        run_promising(&[plans], (usize::MAX, usize::MAX), stage, self.progress)
    }
}
