//! Forwards: sets of effects grow by one at a time, several sets side by side.

use super::candidate_fit::CandidateFit;
use super::candidate_set::{Candidate, acts_ahead_of};
use super::data_split::DataSplit;
use super::looks::LookCache;
use super::model_selection::{improves, is_identifiable, over_floor, same_set};
use super::parallel::{Finalists, run_promising};
use super::progress::SearchEvent;
use super::search_space::Search;
use super::thresholds::THRESHOLDS;
use crate::model::Effect;

impl Search<'_> {
    /// Carries the best sets on, one effect deeper each time, until nothing is left to explain.
    pub(crate) fn grow_sets(
        &self,
        split: &DataSplit,
        base: &[String],
        refitted: &CandidateFit,
        (fits, looks): (&mut Vec<CandidateFit>, &mut LookCache),
    ) {
        let mut before = refitted.clone();
        let mut left = f64::INFINITY;
        for depth in 1..THRESHOLDS.most_effects {
            let identifiable = self.identifiable(split, fits, depth);
            let paying: Vec<&CandidateFit> =
                identifiable.iter().copied().filter(|fitted| improves(split, &before, fitted)).collect();
            let falls = !paying.is_empty();
            // Alone no effect may gain enough, and two together may.
            let front = if falls { &paying } else { &identifiable };
            let Some(best) = front.first().map(|best| (*best).clone()) else { return };
            (self.progress)(SearchEvent::Leading(&best.effects));
            let floors = split.validate.white_floors(&best.held_out.residuals, best.model.body.inertia);
            let over = over_floor(split, if falls { &best } else { &before }, &floors).0;
            let is_done = over < THRESHOLDS.done_at_floor;
            let no_pair = !falls && (depth > 1 || over < THRESHOLDS.nearly_at_floor);
            let is_in_vain = depth > 1
                && over > THRESHOLDS.hopeless_over_floor
                && over > THRESHOLDS.hopeless_left * left
                && !split.train.is_rotor();
            if is_done || no_pair || is_in_vain {
                return;
            }
            left = over;
            // Beside one that leaves next to nothing the others are only longer ways.
            let beam_width = match depth {
                _ if falls && over < THRESHOLDS.at_floor => 1,
                1 => THRESHOLDS.beam_width_single,
                _ => THRESHOLDS.beam_width_sets,
            };
            let front: Vec<CandidateFit> = front.iter().take(beam_width).map(|it| (*it).clone()).collect();
            let mut groups = self.one_deeper(&front, fits, base);
            let ahead = if depth == 1 { self.ahead_of_grid(&front, fits) } else { Vec::new() };
            groups.extend(self.one_deeper(&ahead, fits, base).into_iter().map(|mut group| {
                group.retain(|candidate| candidate.effects.last().is_some_and(|last| last.is_grid()));
                group
            }));
            let most = if depth == 1 { THRESHOLDS.pair_candidates } else { THRESHOLDS.set_candidates };
            fits.extend(run_promising(&groups, Finalists::of(most), (split, looks), self.progress));
            before = best;
        }
    }

    /// Beside each set of the front the candidates with one effect more, none that is known or another one's. A grid is looked for
    /// beside all that it stands beside, too: what was found without some of that may be another one.
    pub(crate) fn one_deeper<'b>(
        &'b self,
        front: &'b [CandidateFit],
        fits: &[CandidateFit],
        base: &[String],
    ) -> Vec<Vec<Candidate<'b>>> {
        let mut sets: Vec<Vec<String>> = fits.iter().map(|fitted| fitted.effects.clone()).collect();
        let same_way =
            |a: &[String], b: &[String]| same_set(a, b) && self.ends_on_grid(a) == self.ends_on_grid(b);
        let mut beside = |fitted: &'b CandidateFit| {
            let mut candidates = Vec::new();
            for effect in self.admitted() {
                let set = [&fitted.effects[..], std::slice::from_ref(&effect.id)].concat();
                if fitted.effects.contains(&effect.id) || sets.iter().any(|known| same_way(known, &set)) {
                    continue;
                }
                sets.push(set);
                let mut effects: Vec<&Effect> =
                    self.known.iter().filter(|known| fitted.effects.contains(&known.id)).collect();
                effects.sort_by_key(|known| fitted.effects.iter().position(|id| *id == known.id));
                effects.push(effect);
                let without = Some(fitted.fit.cost);
                candidates.push(Candidate { effects, without, ..self.start(&fitted.model, base) });
            }
            candidates
        };
        front.iter().map(&mut beside).collect()
    }

    /// Where a grid is one of the front, the effects that act ahead of one and are no grids: a grid hides what a dead zone gains alone, and
    /// one that was found without that lies elsewhere.
    fn ahead_of_grid(&self, front: &[CandidateFit], fits: &[CandidateFit]) -> Vec<CandidateFit> {
        let grids: Vec<&Effect> = self.admitted().into_iter().filter(|effect| effect.is_grid()).collect();
        let is_any_in_front = grids.iter().any(|grid| front.iter().any(|set| set.effects.contains(&grid.id)));
        let acts_ahead = |fitted: &&CandidateFit| {
            let [id] = fitted.effects.as_slice() else { return false };
            let law = self.known.iter().find(|effect| effect.id == *id);
            law.is_some_and(|law| grids.iter().any(|grid| acts_ahead_of(law, grid, &fitted.model.with(grid))))
        };
        let others = fits.iter().filter(|_| is_any_in_front).filter(acts_ahead);
        others.filter(|other| !front.iter().any(|set| set.effects == other.effects)).cloned().collect()
    }

    /// Whether the last effect of a set is one in jumps.
    fn ends_on_grid(&self, set: &[String]) -> bool {
        let last = set.last().map(std::slice::from_ref).unwrap_or_default();
        self.lookup(last).iter().any(|effect| effect.is_grid())
    }

    /// The sets of a depth whose effects are determined and do not cancel each other, best first.
    fn identifiable<'t>(
        &self,
        split: &DataSplit,
        fits: &'t [CandidateFit],
        depth: usize,
    ) -> Vec<&'t CandidateFit> {
        let of_depth = fits.iter().filter(|fitted| fitted.effects.len() == depth);
        let mut identifiable: Vec<&CandidateFit> = of_depth
            .filter(|fitted| is_identifiable(split, fitted, self.known) && !self.has_run_off(fitted))
            .collect();
        identifiable.sort_by(|a, b| a.validate(split).total_cmp(&b.validate(split)));
        identifiable
    }

    /// The smallest set that no larger one beats.
    pub(crate) fn grow_answer(
        &self,
        split: &DataSplit,
        refitted: &CandidateFit,
        fits: &[CandidateFit],
    ) -> CandidateFit {
        // Two effects may gain nothing one by one: each depth is compared with the answer so far.
        self.grow_answer_from(split, refitted.clone(), fits)
    }

    /// The smallest set that holds all of `answer` and that no larger one beats.
    pub(crate) fn grow_answer_from(
        &self,
        split: &DataSplit,
        mut answer: CandidateFit,
        fits: &[CandidateFit],
    ) -> CandidateFit {
        let first = answer.effects.clone();
        let goes_on = |fitted: &&CandidateFit| first.iter().all(|id| fitted.effects.contains(id));
        for depth in first.len() + 1..=THRESHOLDS.most_effects {
            let identifiable = self.identifiable(split, fits, depth).into_iter().filter(goes_on);
            let best = identifiable.into_iter().find(|it| improves(split, &answer, it));
            if let Some(best) = best {
                answer = best.clone();
            }
        }
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::leaves;
    use super::*;
    use crate::model::Model;

    /// A dead zone gains nothing alone where a grid hides it: both are tried together where a grid is one of the best.
    #[test]
    fn what_acts_ahead_of_a_grid_is_tried_with_it() {
        let base = Model::paper();
        let known = base.known_effects().expect("the catalogue");
        let eligible = known.iter().map(|effect| (effect, None)).collect();
        let search = Search { base: &base, known: &known, eligible, progress: &|_| () };
        let single = |id: &str| {
            let model = base.with(known.iter().find(|effect| effect.id == id).expect("known"));
            CandidateFit { effects: vec![id.to_owned()], model, ..leaves(vec![1.0; 10]) }
        };
        let ids = ["command_quantization", "command_dead_zone", "transport_delay", "command_saturation"];
        let fits = ids.map(single);
        let ahead = |front: &[CandidateFit]| -> Vec<String> {
            search.ahead_of_grid(front, &fits).into_iter().flat_map(|fitted| fitted.effects).collect()
        };
        // A dead time moves no level, and a limit acts behind the grid.
        assert_eq!(ahead(&fits[..1]), ["command_dead_zone"]);
        assert!(ahead(&fits[..2]).is_empty(), "it goes on by itself");
        assert!(ahead(&fits[2..]).is_empty(), "no grid is among them");
    }
}
