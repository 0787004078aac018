//! Wider: where the sets that grew leave an error plainly above its noise, the way to the right one leads over effects that gain
//! nothing alone, so more sets are fitted then.

use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::looks::LookCache;
use super::model_selection::{loss, over_floors, over_white_floors, same_set};
use super::parallel::{Finalists, run_all, run_promising};
use super::search_space::Search;
use super::thresholds::THRESHOLDS;
use crate::model::Model;

impl Search<'_> {
    /// Pairs and sets of three that were passed over, and those that differ from the best three by one effect. Whether it was not looked on
    /// because that is in vain.
    pub(crate) fn look_wider(
        &self,
        split: &DataSplit,
        base: &[String],
        refitted: &CandidateFit,
        (fits, looks): (&mut Vec<CandidateFit>, &mut LookCache),
    ) -> bool {
        let is_unexplained = |fits: &[CandidateFit]| {
            over_floors(split, &self.grow_answer(split, refitted, fits)) > THRESHOLDS.at_floor
        };
        for depth in [1, 2] {
            if !is_unexplained(fits) {
                return false;
            }
            if is_in_vain(split, (refitted, fits), depth) {
                return true;
            }
            let front = least(split, fits, depth, THRESHOLDS.wide_beam);
            let groups = self.one_deeper(&front, fits, base);
            let limit = reach(split, fits, depth + 1);
            let finalists = Finalists { limit, ..Finalists::of(THRESHOLDS.wide_candidates) };
            fits.extend(run_promising(&groups, finalists, (split, looks), self.progress));
        }
        for _ in 0..THRESHOLDS.most_exchanges {
            if !is_unexplained(fits) {
                return false;
            }
            let best = least(split, fits, 3, 1);
            let Some(best) =
                best.first().filter(|best| over_floors(split, best) < THRESHOLDS.exchange_over_floor)
            else {
                return false;
            };
            let exchanged = self.one_exchanged(best, fits);
            let candidates = exchanged.iter().map(|(model, set)| self.candidate(model, set, base)).collect();
            fits.extend(run_promising(
                &[candidates],
                Finalists::of(THRESHOLDS.exchange_candidates),
                (split, looks),
                self.progress,
            ));
        }
        false
    }

    /// The answer fitted at once from where its effects start: the way on which it grew may have ended in another valley.
    pub(crate) fn fit_jointly(
        &self,
        split: &DataSplit,
        base: &[String],
        refitted: &CandidateFit,
        fits: &mut Vec<CandidateFit>,
    ) {
        let answer = self.grow_answer(split, refitted, fits);
        if answer.effects.len() > 1 && over_white_floors(split, &answer) > THRESHOLDS.done_at_floor {
            fits.extend(run_all(
                &[self.candidate(&refitted.model, &answer.effects, base)],
                split,
                self.progress,
            ));
        }
    }

    /// The sets that have another effect in the place of one of `best`, none that is known, and what to fit them from.
    fn one_exchanged(&self, best: &CandidateFit, fits: &[CandidateFit]) -> Vec<(Model, Vec<String>)> {
        let without = |id: &String| {
            let kept: Vec<String> = best.effects.iter().filter(|other| *other != id).cloned().collect();
            let others = self.admitted().into_iter().filter(|other| !best.effects.contains(&other.id));
            let sets = others.map(|other| [&kept[..], std::slice::from_ref(&other.id)].concat());
            let new = sets.filter(|set| !fits.iter().any(|fitted| same_set(&fitted.effects, set)));
            new.map(|set| (best.model.without(id), set)).collect::<Vec<_>>()
        };
        best.effects.iter().flat_map(without).collect()
    }
}

/// Whether so many effects and more leave nearly as much as one less, far above the noise: there is something else, and what is found
/// further on bends a curve to the data. The larger error over its noise and the squares of all data must both be nearly as large as before: of
/// two logs one may hardly show what the other shows well.
fn is_in_vain(split: &DataSplit, (refitted, fits): (&CandidateFit, &[CandidateFit]), effects: usize) -> bool {
    let best = |effects: usize| least(split, fits, effects, 1).into_iter().next();
    let before = if effects == 1 { Some(refitted.clone()) } else { best(effects - 1) };
    let now: Vec<CandidateFit> = (effects..=THRESHOLDS.most_effects).filter_map(best).collect();
    let smallest = |of: &dyn Fn(&CandidateFit) -> f64| now.iter().map(of).reduce(f64::min);
    let over = |set: &CandidateFit| over_floors(split, set);
    let (Some(before), Some(over_now), Some(loss_now)) =
        (before, smallest(&over), smallest(&|set| loss(split, set)))
    else {
        return false;
    };
    let left = THRESHOLDS.hopeless_left;
    over_now > THRESHOLDS.hopeless_over_floor
        && over_now > left * over(&before)
        && loss_now > left.powi(2) * loss(split, &before)
}

/// Training cost beyond which a set of so many effects is out of reach of the best known. The one that leaves least of what it was fitted
/// on may have bent to it: what is held out counts, too.
fn reach(split: &DataSplit, fits: &[CandidateFit], effects: usize) -> f64 {
    let best = least(split, fits, effects, 1);
    best.first().map_or(f64::INFINITY, |fitted| THRESHOLDS.wide_reach * fitted.fit.cost)
}

/// The sets of so many effects that leave least on all data, whether or not each effect of theirs gains anything.
pub(crate) fn least(
    split: &DataSplit,
    fits: &[CandidateFit],
    effects: usize,
    most: usize,
) -> Vec<CandidateFit> {
    let mut sets: Vec<(f64, &CandidateFit)> =
        of_size(fits, effects).map(|fitted| (loss(split, fitted), fitted)).collect();
    // What ran away leaves no number.
    sets.retain(|(loss, _)| loss.is_finite());
    sets.sort_by(|a, b| a.0.total_cmp(&b.0));
    sets.into_iter().take(most).map(|(_, fitted)| fitted.clone()).collect()
}

fn of_size(fits: &[CandidateFit], effects: usize) -> impl Iterator<Item = &CandidateFit> {
    fits.iter().filter(move |fitted| fitted.effects.len() == effects)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::super::progress::SearchEvent;
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::*;

    /// What is left of noise and an error so many times as large that stays for a second.
    fn left(size: f64) -> CandidateFit {
        leaves((0..ROWS).map(|row| noise(row) + size * noise(ROWS + row / 100)).collect())
    }

    /// Ten times the noise: a second effect that takes off a tenth of the error is one of many things, one that takes off half of it is
    /// not.
    #[test]
    fn far_above_the_noise_no_third_effect_is_looked_for_where_a_second_one_does_little() {
        let split = split();
        let set = |effects: &[&str], size: f64| {
            let effects = effects.iter().map(|id| (*id).to_owned()).collect();
            CandidateFit { effects, ..left(size) }
        };
        let base = left(12.0);
        let is_in_vain = |one: f64, two: f64, depth: usize| {
            super::is_in_vain(&split, (&base, &[set(&["a"], one), set(&["a", "b"], two)]), depth)
        };
        assert!(is_in_vain(11.0, 10.5, 1) && !is_in_vain(6.0, 10.5, 1));
        assert!(!is_in_vain(11.0, 5.0, 1), "two that grew from it do much");
        assert!(is_in_vain(11.0, 10.0, 2) && !is_in_vain(11.0, 5.0, 2));
        assert!(!is_in_vain(2.2, 2.0, 2), "two of three leave as little");
        assert!(!super::is_in_vain(&split, (&base, &[]), 1), "none is known");
        // Steps of the log that is fitted on, and next to none of that held out: there a delay does nothing.
        let shown = CandidateFit { held_out: left(11.0).fit, ..set(&["a"], 2.0) };
        assert!(
            !super::is_in_vain(&split, (&base, &[shown]), 1),
            "of what it was fitted on it explains nearly all"
        );
    }

    #[test]
    fn what_one_more_effect_hardly_lowers_is_left_alone() {
        let (split, base) = (split(), Model::paper());
        let known = base.known_effects().expect("the catalogue");
        let effect = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let ids = ["transport_delay", "static_offset"];
        let asked = AtomicUsize::new(0);
        let count = |_: SearchEvent| {
            asked.fetch_add(1, Ordering::Relaxed);
        };
        let eligible = ids.map(|id| (effect(id), None)).to_vec();
        let search = Search { base: &base, known: &known, eligible, progress: &count };
        for (single, is_looked_wider) in [(11.0, false), (5.0, true)] {
            let of = |id: &str| CandidateFit {
                effects: vec![id.to_owned()],
                model: base.with(effect(id)),
                ..left(single)
            };
            let mut fits = ids.map(of).to_vec();
            asked.store(0, Ordering::Relaxed);
            search.look_wider(&split, &[], &left(12.0), (&mut fits, &mut LookCache::default()));
            assert_eq!(asked.load(Ordering::Relaxed) > 0, is_looked_wider, "one leaves {single} of 12");
        }
    }

    #[test]
    fn a_set_that_bent_to_what_it_was_fitted_on_puts_none_out_of_reach() {
        let split = split();
        let set = |effects: &[&str], fitted: f64, held_out: f64| {
            let leaves = |size: f64| leaves((0..ROWS).map(|row| size * noise(row)).collect());
            let effects = effects.iter().map(|id| (*id).to_owned()).collect();
            CandidateFit { effects, held_out: leaves(held_out).fit, ..leaves(fitted) }
        };
        let (bent, plain) = (set(&["a", "b"], 1.0, 20.0), set(&["a", "c"], 2.0, 2.0));
        let cost = plain.fit.cost;
        assert_eq!(reach(&split, &[bent, plain], 2), THRESHOLDS.wide_reach * cost);
        assert_eq!(reach(&split, &[], 2), f64::INFINITY, "none is known");
    }
}
