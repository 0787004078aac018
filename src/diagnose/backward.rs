//! Backwards: each effect of an answer left out, or exchanged for one that it is confused with.

use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::looks::LookCache;
use super::model_selection::{improves, indistinguishable, loss, same_set};
use super::parallel::{Finalists, run_promising};
use super::search_space::Search;
use super::thresholds::THRESHOLDS;
use crate::model::Model;
use crate::threads::spread;

impl Search<'_> {
    /// Drops one effect at a time until each that stays is selected by itself; the sets without each of those.
    pub(crate) fn eliminate(
        &self,
        split: &DataSplit,
        best: &mut CandidateFit,
        base: &[String],
        refitted: &CandidateFit,
        fits: &mut [CandidateFit],
    ) -> Vec<CandidateFit> {
        loop {
            let dropped = self.each_dropped(split, best, base, refitted, fits);
            let insignificant = dropped.iter().filter(|without| !improves(split, without, best));
            let Some(without) = insignificant.min_by(|a, b| a.validate(split).total_cmp(&b.validate(split)))
            else {
                return dropped;
            };
            *best = without.clone();
        }
    }

    /// For each effect of `best` the set without it; `fits` takes it where it is better than the one known.
    pub(crate) fn each_dropped(
        &self,
        split: &DataSplit,
        best: &CandidateFit,
        base: &[String],
        refitted: &CandidateFit,
        fits: &mut [CandidateFit],
    ) -> Vec<CandidateFit> {
        let dropped = spread(&best.effects, |id| self.without(split, (best, id), base, refitted, fits));
        for without in &dropped {
            if let Some(known) = fits.iter_mut().find(|fitted| same_set(&fitted.effects, &without.effects)) {
                known.clone_from(without);
            }
        }
        dropped
    }

    fn without(
        &self,
        split: &DataSplit,
        (best, id): (&CandidateFit, &str),
        base: &[String],
        refitted: &CandidateFit,
        fits: &[CandidateFit],
    ) -> CandidateFit {
        if best.effects.len() == 1 {
            return refitted.clone();
        }
        let left: Vec<String> = best.effects.iter().filter(|other| *other != id).cloned().collect();
        let known = fits.iter().find(|fitted| same_set(&fitted.effects, &left));
        if let Some(known) = known.filter(|known| !improves(split, known, best)) {
            return known.clone();
        }
        // A fit of the smaller set may have ended on its way: an effect must gain more than a better start does.
        let model = best.model.without(id);
        let again = self.candidate(&model, &left, base).run(split);
        known.filter(|known| known.fit.cost <= again.fit.cost).cloned().unwrap_or(again)
    }

    /// The answer with each effect exchanged for those that it is confused with, by its card or theirs.
    pub(crate) fn swaps(
        &self,
        split: &DataSplit,
        best: &CandidateFit,
        fits: &[CandidateFit],
        base: &[String],
    ) -> Vec<CandidateFit> {
        // A set that is confused with the answer and was fitted on a longer way may have ended elsewhere.
        let limit = (1.0 + THRESHOLDS.least_gain) * loss(split, best);
        let models = self.confused_sets(best, |set| {
            fits.iter().any(|it| same_set(&it.effects, set) && loss(split, it) <= limit)
        });
        let candidates = models.iter().map(|(model, set)| self.candidate(model, set, base)).collect();
        run_promising(
            &[candidates],
            Finalists::of((usize::MAX, usize::MAX)),
            (split, &mut LookCache::default()),
            self.progress,
        )
    }

    /// The sets with an effect of `best` exchanged for one that it is confused with, by its card or the other's, but those known, and what
    /// to fit them from.
    pub(crate) fn confused_sets(
        &self,
        best: &CandidateFit,
        is_known: impl Fn(&[String]) -> bool,
    ) -> Vec<(Model, Vec<String>)> {
        if best.effects.len() < 2 {
            return Vec::new();
        }
        let admitted = self.admitted();
        let mut models = Vec::new();
        for id in &best.effects {
            for other in admitted.iter().filter(|other| self.are_confused(id, &other.id)) {
                let exchanged = |kept: &String| if kept == id { other.id.clone() } else { kept.clone() };
                let set: Vec<String> = best.effects.iter().map(exchanged).collect();
                if !best.effects.contains(&other.id) && !is_known(&set) {
                    models.push((best.model.without(id), set));
                }
            }
        }
        models
    }

    /// Where the data cannot tell one effect of the answer from another one, and a second one from a third, most often not both
    /// at once either: the sets with two exchanges, fitted.
    pub(crate) fn two_exchanged(
        &self,
        split: &DataSplit,
        best: &CandidateFit,
        fits: &[CandidateFit],
        base: &[String],
    ) -> Vec<CandidateFit> {
        let near = indistinguishable(split, best, fits, self.known);
        let exchanged: Vec<(&CandidateFit, &String, &String)> = near
            .iter()
            .take(THRESHOLDS.near_exchanged)
            .filter_map(|other| exchange(&best.effects, &other.effects).map(|(out, by)| (other, out, by)))
            .collect();
        let mut sets: Vec<(Model, Vec<String>)> = Vec::new();
        for (place, (one, out, by)) in exchanged.iter().enumerate() {
            for (_, other_out, other_by) in
                exchanged[place + 1..].iter().filter(|it| it.1 != *out && it.2 != *by)
            {
                let set: Vec<String> = one
                    .effects
                    .iter()
                    .map(|id| if id == *other_out { *other_by } else { id })
                    .cloned()
                    .collect();
                let mut known = fits.iter().map(|it| &it.effects).chain(sets.iter().map(|(_, set)| set));
                if !known.any(|known| same_set(known, &set)) {
                    sets.push((one.model.without(other_out), set));
                }
            }
        }
        let candidates = sets.iter().map(|(model, set)| self.candidate(model, set, base)).collect();
        run_promising(
            &[candidates],
            Finalists::of((usize::MAX, THRESHOLDS.twice_exchanged)),
            (split, &mut LookCache::default()),
            self.progress,
        )
    }

    /// Whether the card of one of two effects says that it is confused with the other.
    pub(crate) fn are_confused(&self, one: &str, other: &str) -> bool {
        let names = |of: &str, named: &str| {
            let card = self.known.iter().find(|effect| effect.id == of).and_then(|effect| effect.card);
            card.is_some_and(|card| card.confused_with.contains(&named))
        };
        names(one, other) || names(other, one)
    }
}

/// The effect of `set` in the place of which `other` has another one, and that one; `None` where they differ by more or less.
pub(crate) fn exchange<'a>(set: &'a [String], other: &'a [String]) -> Option<(&'a String, &'a String)> {
    let mut out = set.iter().filter(|id| !other.contains(id));
    let mut by = other.iter().filter(|id| !set.contains(id));
    let found = (out.next()?, by.next()?);
    (out.next().is_none() && by.next().is_none()).then_some(found)
}
