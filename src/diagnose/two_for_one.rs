//! Two for one: two laws in the place of one of the answer's. One may nearly stand for two, each of which gains next to nothing alone, as
//! near the level a pendulum does for a floor below and a push to one side.

use super::backward::exchange;
use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::looks::LookCache;
use super::model_selection::{
    best_of_each, is_identifiable, loss, over_white_floors, period, same_set, same_share, senses_rotors,
};
use super::parallel::{Finalists, run_all, run_promising};
use super::search_space::Search;
use super::surrogate_test::surrogate;
use super::thresholds::THRESHOLDS;
use super::wider::least;
use crate::model::Model;

impl Search<'_> {
    /// Where the answer leaves little enough to be one, and more than noise: an effect that it is confused with in the place of one of its
    /// own, with one more beside. Two laws that one stands for nearly gain next to nothing one by one.
    pub(crate) fn look_beside_answer(
        &self,
        split: &DataSplit,
        base: &[String],
        refitted: &CandidateFit,
        (fits, looks): (&mut Vec<CandidateFit>, &mut LookCache),
    ) {
        // To judge each set takes long; where the best leave too much none is an answer.
        let leaves_much = |effects: usize| {
            let best = least(split, fits, effects, 1);
            best.first().is_none_or(|set| over_white_floors(split, set) >= THRESHOLDS.near_floor)
        };
        if (1..=THRESHOLDS.most_effects).all(leaves_much) {
            return;
        }
        let answer = self.grow_answer(split, refitted, fits);
        let over = over_white_floors(split, &answer);
        let has_room = (1..THRESHOLDS.most_effects - 1).contains(&answer.effects.len());
        if !has_room || !(THRESHOLDS.done_at_floor..THRESHOLDS.near_floor).contains(&over) {
            return;
        }
        let new = self.confused_sets(&answer, |set| fits.iter().any(|it| same_set(&it.effects, set)));
        let candidates = new.iter().map(|(model, set)| self.candidate(model, set, base)).collect();
        let all = Finalists::of((usize::MAX, usize::MAX));
        fits.extend(run_promising(&[candidates], all, (split, looks), self.progress));
        let is_confused = |fitted: &CandidateFit| {
            exchange(&answer.effects, &fitted.effects).is_some_and(|(out, by)| self.are_confused(out, by))
                && loss(split, fitted).is_finite()
        };
        let confused = best_of_each(split, fits.iter().filter(|it| is_confused(it)).cloned().collect());
        let front = least(split, &confused, answer.effects.len(), THRESHOLDS.wide_beam);
        let mut groups = self.one_deeper(&front, fits, base);
        let holds_answer = |set: &Candidate| {
            answer.effects.iter().all(|id| set.effects.iter().any(|effect| effect.id == *id))
        };
        groups.iter_mut().for_each(|group| group.retain(|set| !holds_answer(set)));
        let finalists = Finalists::of(THRESHOLDS.exchange_candidates);
        fits.extend(run_promising(&groups, finalists, (split, looks), self.progress));
    }

    /// Sets with two effects in the place of one of `best`, which is confused with one of the two: one law may stand for two. They leave as
    /// much as it with no more numbers, or less by more than chance, though too little less to be named. None of them holds a set that is
    /// `as_good`. The best of them, those as good as that, and those with no more numbers, nearest first. None where `best` leaves too
    /// much to be an answer: many sets leave a little less then.
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

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::super::progress::SearchEvent;
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

    /// What leaves noise and an error so many times as large that stays for a second.
    fn slowly_off(size: f64) -> CandidateFit {
        leaves((0..ROWS).map(|row| noise(row) + size * noise(ROWS + row / 100)).collect())
    }

    /// Of a pendulum and a scale of the gyro: a floor below and a push to one side stand in the place of the pendulum.
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
        let less_of = |fit: f64, held_out: f64| {
            let (fit, held_out) = (set(&[], fit).fit, set(&[], held_out).fit);
            CandidateFit { fit, held_out, ..of("torque_bias", 0.0) }
        };
        assert_eq!(one(less_of(0.1, 0.0)).len(), 1);
        assert!(one(less_of(0.0, 0.18)).is_empty(), "held out it leaves more");
        assert!(one(less_of(0.18, 0.0)).is_empty(), "of what it was fitted on it leaves more");
        let mut undetermined = of("torque_bias", 0.0);
        undetermined.model.standard_errors.insert("torque_bias.torque".to_owned(), 1.0);
        assert!(one(undetermined).is_empty(), "a torque of 0.5 ± 1.0 N m");
        let in_one_stretch = |row: usize| if row < ROWS / 24 { noise(row + 100_000) } else { 0.0 };
        let left = |share: f64| (0..ROWS).map(|row| noise(row) + share * in_one_stretch(row)).collect();
        // The same numbers, and what another set leaves.
        let leaving = |of: &CandidateFit, left: CandidateFit| CandidateFit {
            fit: left.fit,
            held_out: left.held_out,
            ..of.clone()
        };
        let (event, without) = (leaving(&best, leaves(left(0.8))), leaving(&fits[0], leaves(left(0.0))));
        assert!(listed(&event, &[], &[without]).is_empty(), "an event");
        let alternating = |row: usize| if row.is_multiple_of(2) { 0.16 } else { -0.16 };
        let pattern = leaves((0..ROWS).map(|row| noise(row) + alternating(row)).collect());
        let (pattern, without) = (leaving(&best, pattern), leaving(&fits[0], leaves(left(0.0))));
        assert!(listed(&pattern, &[], &[without]).is_empty(), "shifted by two rows it does as well");
        let (far, less) = (leaving(&best, slowly_off(3.0)), leaving(&fits[0], slowly_off(2.5)));
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

    /// Whether the rotors act late or are read late is asked of the body, and not here.
    #[test]
    fn no_set_that_reads_the_rotors_late_stands_for_one_that_does_not() {
        let (base, split) = (Model::paper(), split());
        let known = base.known_effects().expect("the catalogue");
        let search = Search { base: &base, known: &known, eligible: Vec::new(), progress: &|_| () };
        let best = set(&["transport_delay", "static_cubic"], 0.16);
        for (id, listed) in [("asymmetric_pole", 1), ("telemetry_lag", 0)] {
            let other = set(&["static_cubic", "second_order_lag", id], 0.0);
            assert_eq!(search.two_for_one(&split, &best, &[], &[other]).len(), listed, "{id}");
        }
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

    /// Of a delay and an offset that would be named and leave more than noise: a lag of the reading is confused with the delay.
    #[test]
    fn an_answer_that_leaves_more_than_noise_is_tried_with_another_law_and_one_more() {
        let (split, base) = (split(), Model::paper());
        let known = base.known_effects().expect("the catalogue");
        let effect = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let ids = ["transport_delay", "static_offset", "telemetry_lag", "speed_dependent_pole"];
        let tried = Mutex::new(Vec::new());
        let hears = |event: SearchEvent| {
            if let SearchEvent::Tried { effects, .. } = event {
                let mut set = effects.to_vec();
                set.sort();
                tried.lock().expect("no test fails in it").push(set.join(" "));
            }
        };
        let eligible = ids.map(|id| (effect(id), None)).to_vec();
        let search = Search { base: &base, known: &known, eligible, progress: &hears };
        let mut model = base.with(effect("transport_delay")).with(effect("static_offset"));
        for (name, value) in [("transport_delay.delay", 0.02), ("static_offset.coefficient", 20.0)] {
            model.set_parameter(name, value);
            model.standard_errors.insert(name.to_owned(), 0.05 * value);
        }
        let tried_where = |size: f64| {
            let effects = ids[..2].iter().map(|id| (*id).to_owned()).collect();
            let mut fits = vec![CandidateFit { effects, model: model.clone(), ..slowly_off(size) }];
            search.look_beside_answer(&split, &[], &slowly_off(12.0), (&mut fits, &mut LookCache::default()));
            let mut tried = std::mem::take(&mut *tried.lock().expect("no test fails in it"));
            tried.sort();
            tried
        };
        assert!(tried_where(0.0).is_empty(), "nothing but noise is left");
        assert_eq!(
            tried_where(1.2),
            ["speed_dependent_pole static_offset telemetry_lag", "static_offset telemetry_lag"],
            "none holds the answer and more"
        );
        assert!(tried_where(3.0).is_empty(), "nobody would name it");
    }
}
