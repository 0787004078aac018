//! Backwards: each effect of an answer left out, or exchanged for one that it is confused with.

use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::looks::LookCache;
use super::model_selection::{
    best_of_each, improves, indistinguishable, is_identifiable, loss, over_white_floors, period, same_set,
    same_share, senses_rotors,
};
use super::parallel::{Finalists, run_all, run_promising};
use super::search_space::Search;
use super::surrogate_test::surrogate;
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

    /// Sets with two effects in the place of one of `best`, which is confused with one of the two: one law may stand for two. They leave as
    /// much as it with no more numbers, or less by more than chance, though too little less to be named. None of them holds a set that is
    /// `as_good`. The best of them, those as good as that, and those with no more numbers, nearest first; none where `best` leaves too much to be an answer: many sets
    /// leave a little less then.
    pub(crate) fn two_for_one(
        &self,
        split: &DataSplit,
        best: &CandidateFit,
        as_good: &[CandidateFit],
        fits: &[CandidateFit],
    ) -> Vec<CandidateFit> {
        if over_white_floors(split, best) >= THRESHOLDS.near_floor {
            return Vec::new();
        }
        let (same, left) = (same_share(best), loss(split, best));
        let holds =
            |set: &CandidateFit, part: &CandidateFit| part.effects.iter().all(|id| set.effects.contains(id));
        let is_as_good = |set: &CandidateFit| {
            self.numbers(set) <= self.numbers(best) && loss(split, set) <= (1.0 + same) * left
        };
        let larger = fits.iter().filter(|set| {
            let is_better =
                |set| loss(split, set) < (1.0 - same) * left && is_more_than_chance(split, best, set);
            self.has_two_for_one(set, best)
                && senses_rotors(set) == senses_rotors(best)
                && (is_as_good(set) || is_better(set))
                && !has_filler(split, set, best, fits)
                && !as_good.iter().any(|part| holds(set, part))
                && is_identifiable(split, set, self.known)
        });
        let mut larger = best_of_each(split, larger.cloned().collect());
        larger.sort_by(|a, b| loss(split, a).total_cmp(&loss(split, b)));
        let least = larger.first().map_or(0.0, |set| loss(split, set));
        larger.retain(|set| is_as_good(set) || loss(split, set) <= (1.0 + same) * least);
        larger
    }

    fn numbers(&self, set: &CandidateFit) -> usize {
        self.lookup(&set.effects).iter().map(|effect| effect.parameters.len()).sum()
    }

    /// The sets with two effects, both confused with one of `best`, in its place, that have no more numbers than it, and what to fit them
    /// from: a cable and a constant torque for a pendulum. However little the answer leaves, they may leave as little.
    fn as_many_numbers(&self, best: &CandidateFit, fits: &[CandidateFit]) -> Vec<(Model, Vec<String>)> {
        let mut models = Vec::new();
        for (at, effect) in self.lookup(&best.effects).iter().enumerate() {
            let mut others = self.admitted();
            others.retain(|it| !best.effects.contains(&it.id) && self.are_confused(&effect.id, &it.id));
            for (place, one) in others.iter().enumerate() {
                for two in &others[place + 1..] {
                    let mut set = best.effects.clone();
                    set.splice(at..=at, [one.id.clone(), two.id.clone()]);
                    let is_new = !fits.iter().any(|it| same_set(&it.effects, &set));
                    if is_new && one.parameters.len() + two.parameters.len() <= effect.parameters.len() {
                        models.push((best.model.without(&effect.id), set));
                    }
                }
            }
        }
        models
    }

    /// Those sets, fitted; none where they would not be listed.
    pub(crate) fn two_with_as_many_numbers(
        &self,
        split: &DataSplit,
        best: &CandidateFit,
        fits: &[CandidateFit],
        base: &[String],
    ) -> Vec<CandidateFit> {
        if over_white_floors(split, best) >= THRESHOLDS.near_floor {
            return Vec::new();
        }
        let models = self.as_many_numbers(best, fits);
        let candidates: Vec<_> = models.iter().map(|(model, set)| self.candidate(model, set, base)).collect();
        run_all(&candidates, split, self.progress)
    }

    /// Whether a set has two effects in the place of one of `best`, and that one is confused with one of the two.
    fn has_two_for_one(&self, set: &CandidateFit, best: &CandidateFit) -> bool {
        let mut out = best.effects.iter().filter(|id| !set.effects.contains(id));
        let (Some(out), None) = (out.next(), out.next()) else { return false };
        let mut by = set.effects.iter().filter(|id| !best.effects.contains(id));
        set.effects.len() == best.effects.len() + 1 && by.any(|by| self.are_confused(out, by))
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

/// Whether a set does nearly as well without one of the effects that `best` has not got: then it is another one in the place of one, and
/// something small beside.
fn has_filler(split: &DataSplit, set: &CandidateFit, best: &CandidateFit, fits: &[CandidateFit]) -> bool {
    set.effects.iter().filter(|id| !best.effects.contains(id)).any(|id| {
        let rest: Vec<String> = set.effects.iter().filter(|other| *other != id).cloned().collect();
        let without = fits.iter().filter(|fitted| same_set(&fitted.effects, &rest));
        let least = without.map(|fitted| loss(split, fitted)).fold(f64::INFINITY, f64::min);
        loss(split, set) > (1.0 - THRESHOLDS.least_gain) * least
    })
}

/// Whether `after` leaves less than `before` on both parts, in one stretch as in the other, and by more than the same trace does when it
/// is shifted.
fn is_more_than_chance(split: &DataSplit, before: &CandidateFit, after: &CandidateFit) -> bool {
    after.validate(split) < before.validate(split)
        && after.fit.cost < before.fit.cost
        && before.consistency(after) > THRESHOLDS.consistent
        && surrogate(before, after, period(split)).p_value <= THRESHOLDS.significance_level
}

/// The effect of `set` in the place of which `other` has another one, and that one; `None` where they differ by more or less.
pub(crate) fn exchange<'a>(set: &'a [String], other: &'a [String]) -> Option<(&'a String, &'a String)> {
    let mut out = set.iter().filter(|id| !other.contains(id));
    let mut by = other.iter().filter(|id| !set.contains(id));
    let found = (out.next()?, by.next()?);
    (out.next().is_none() && by.next().is_none()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::*;

    /// A set of effects with numbers that are known, beside which this share of a trace without a pattern is left.
    fn set(effects: &[&str], left: f64) -> CandidateFit {
        let base = Model::paper();
        let known = base.known_effects().expect("the catalogue");
        let mut model = base;
        for effect in effects.iter().filter_map(|id| known.iter().find(|effect| effect.id == *id)) {
            model = model.with(effect);
            for parameter in &effect.parameters {
                let name = format!("{}.{}", effect.id, parameter.name);
                model.set_parameter(&name, 0.5);
                model.standard_errors.insert(name, 1e-3);
            }
        }
        let residuals = (0..ROWS).map(|row| noise(row) + left * noise(row + 100_000)).collect();
        let effects = effects.iter().map(|id| (*id).to_owned()).collect();
        CandidateFit { effects, model, ..leaves(residuals) }
    }

    /// Of a pendulum and a lag of the gyro: a floor below and a push to one side stand in the place of the pendulum.
    #[test]
    fn two_effects_in_the_place_of_one_are_listed_where_they_leave_less() {
        let (base, split) = (Model::paper(), split());
        let known = base.known_effects().expect("the catalogue");
        let listed = |best: &CandidateFit, as_good: &[CandidateFit], fits: &[CandidateFit]| {
            let search = Search { base: &base, known: &known, eligible: Vec::new(), progress: &|_| () };
            let sets = search.two_for_one(&split, best, as_good, fits);
            sets.iter().map(|set| set.effects.join(" ")).collect::<Vec<_>>()
        };
        let best = set(&["gravity_pendulum", "gyro_scale"], 0.16);
        let of = |other: &str, left: f64| set(&["gyro_scale", "ground_effect", other], left);
        let one = |fitted: CandidateFit| listed(&best, &[], &[fitted]);
        // Of the square 0.16 is a fortieth, and half a percent 0.07.
        let fits = [
            of("torque_bias", 0.02),
            of("inflow_damping", 0.12),
            of("torque_bias", 0.05),
            of("actuator_mismatch", 0.0),
        ];
        let both = ["gyro_scale ground_effect actuator_mismatch", "gyro_scale ground_effect torque_bias"];
        assert_eq!(listed(&best, &[], &fits), both, "one leaves more than the best");
        assert!(one(of("torque_bias", 0.155)).is_empty(), "it leaves as much");
        assert!(one(set(&["gravity_pendulum", "gyro_scale", "torque_bias"], 0.0)).is_empty(), "and one more");
        assert!(
            one(set(&["gyro_scale", "inflow_damping", "gyro_bias"], 0.0)).is_empty(),
            "confused with neither"
        );
        assert!(one(set(&["gyro_bias", "ground_effect", "torque_bias"], 0.0)).is_empty(), "three for two");
        assert!(one(set(&["gyro_scale", "ground_effect"], 0.0)).is_empty(), "no larger");
        let twin = [set(&["gyro_scale", "ground_effect"], 0.1), of("torque_bias", 0.02)];
        assert!(
            listed(&best, &[], &twin).is_empty(),
            "a floor in the place of the pendulum, and something small"
        );
        let as_good = set(&["gyro_scale", "torque_bias"], 0.16);
        assert_eq!(listed(&best, &[as_good], &fits), both[..1], "the other has a set as good, and one more");
        let bent = CandidateFit { held_out: set(&[], 0.2).fit, ..of("torque_bias", 0.0) };
        assert!(one(bent).is_empty(), "held out it leaves more");
        let in_one_stretch = |row: usize| if row < ROWS / 24 { noise(row + 100_000) } else { 0.0 };
        let left = |share: f64| (0..ROWS).map(|row| noise(row) + share * in_one_stretch(row)).collect();
        let event = CandidateFit { effects: best.effects.clone(), ..leaves(left(0.8)) };
        let without =
            CandidateFit { fit: leaves(left(0.0)).fit, held_out: leaves(left(0.0)).fit, ..fits[0].clone() };
        assert!(listed(&event, &[], &[without]).is_empty(), "an event");
        let slow = |size: f64| (0..ROWS).map(|row| noise(row) + size * noise(ROWS + row / 100)).collect();
        let far = CandidateFit { effects: best.effects.clone(), ..leaves(slow(3.0)) };
        let less =
            CandidateFit { fit: leaves(slow(2.5)).fit, held_out: leaves(slow(2.5)).fit, ..fits[0].clone() };
        assert!(listed(&far, &[], &[less]).is_empty(), "far above its noise");
        let as_many = |left: f64| set(&["gyro_scale", "cable_stiffness", "torque_bias"], left);
        assert_eq!(one(as_many(0.165)).len(), 1, "as many numbers as a pendulum has, and it leaves as much");
        assert_eq!(
            listed(&best, &[], &[as_many(0.165), of("torque_bias", 0.0)]).len(),
            2,
            "each by its own right"
        );
        assert!(one(as_many(0.2)).is_empty(), "it leaves more");
    }

    #[test]
    fn what_has_as_many_numbers_in_two_effects_is_fitted() {
        let base = Model::paper();
        let known = base.known_effects().expect("the catalogue");
        let eligible = known.iter().map(|effect| (effect, None)).collect();
        let search = Search { base: &base, known: &known, eligible, progress: &|_| () };
        let best = set(&["gyro_lag", "gravity_pendulum"], 0.0);
        let sets = |fits: &[CandidateFit]| -> Vec<Vec<String>> {
            search.as_many_numbers(&best, fits).into_iter().map(|(_, set)| set).collect()
        };
        // A floor has two numbers itself.
        let found = sets(&[]);
        let both = ["gyro_lag", "cable_stiffness", "torque_bias"].map(str::to_owned);
        assert!(found.len() == 1 && same_set(&found[0], &both), "{found:?}");
        assert!(sets(&[set(&["cable_stiffness", "torque_bias", "gyro_lag"], 0.0)]).is_empty(), "known");
    }
}
