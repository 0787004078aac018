//! Candidates fitted on every core.

use super::candidate::{StartingPoints, fits_briefly_on_all};
use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::looks::{LookCache, LookDepth};
use super::progress::SearchEvent;
use super::thresholds::THRESHOLDS;
use crate::threads::{spread, spread_out};

/// Fits candidates on every core; `progress` hears of each.
pub fn run_all(
    candidates: &[Candidate],
    split: &DataSplit,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Vec<CandidateFit> {
    spread(candidates, |candidate| {
        let fitted = candidate.run(split);
        progress(SearchEvent::Fitted);
        reported(fitted, split, progress)
    })
}

/// The same from where fits in other units ended.
pub fn run_all_near(
    candidates: &[Candidate],
    split: &DataSplit,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Vec<CandidateFit> {
    spread(candidates, |candidate| {
        let fitted = candidate.run_near(split);
        progress(SearchEvent::Fitted);
        reported(fitted, split, progress)
    })
}

/// A candidate that was fitted to the end, `progress` having heard what it leaves.
fn reported(
    fitted: CandidateFit,
    split: &DataSplit,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> CandidateFit {
    progress(SearchEvent::Tried { effects: &fitted.effects, over_noise: fitted.validate(split).sqrt() });
    fitted
}

/// Runs effects one by one. A body's are fitted on a part of the data first, where there are many, and those that leave
/// far more than the best one are not fitted to the last digit.
pub fn run_singles(
    candidates: &[Candidate],
    split: &DataSplit,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Vec<CandidateFit> {
    if split.train.is_rotor() || split.coarse.is_none() {
        return run_all(candidates, split, progress);
    }
    let fitted_briefly = spread(candidates, |candidate| {
        progress(SearchEvent::Fitted);
        candidate.fit_briefly(candidate.starting_points(split), split, None)
    });
    let best = fitted_briefly.iter().map(StartingPoints::cost).fold(f64::INFINITY, f64::min);
    spread_out(candidates.iter().zip(fitted_briefly).collect(), |(candidate, starting_points)| {
        let is_near = starting_points.cost() <= THRESHOLDS.hopeless_single * best;
        let starting_points = if is_near { starting_points.with_full_fit() } else { starting_points };
        reported(candidate.finish(starting_points, split), split, progress)
    })
}

/// How many candidates are fitted on.
#[derive(Debug, Clone, Copy)]
pub struct Finalists {
    /// Of each group those fitted briefly.
    pub most: usize,
    /// Of all those fitted to the end.
    pub finished: usize,
    /// Cost on all training data beyond which none is fitted to the end.
    pub limit: f64,
}

impl Finalists {
    /// So many of each group briefly, and of all to the end.
    pub fn of((most, finished): (usize, usize)) -> Self {
        Self { most, finished, limit: f64::INFINITY }
    }
}

/// Of the most promising `most` of each group of candidates, by a look at a part of the data, runs those `finished` to the end
/// that are best when they have been fitted for a while. What `looks` knows is not done again.
pub fn run_promising(
    groups: &[Vec<Candidate>],
    Finalists { most, finished, limit }: Finalists,
    (split, looks): (&DataSplit, &mut LookCache),
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Vec<CandidateFit> {
    let all: Vec<(usize, &Candidate)> = groups
        .iter()
        .enumerate()
        .flat_map(|(group, candidates)| candidates.iter().map(move |candidate| (group, candidate)))
        .collect();
    let candidates = all.iter().map(|(_, candidate)| (*candidate, ())).collect();
    let scored = looks.of(candidates, LookDepth::Look, |candidate, ()| {
        progress(SearchEvent::Fitted);
        candidate.starting_points(split)
    });
    let mut scored: Vec<((usize, &Candidate), StartingPoints)> = all.into_iter().zip(scored).collect();
    scored.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
    let mut taken = vec![0; groups.len()];
    // The law of the battery has no numbers of its own. It changes which numbers of the base fit best, and a first look is too short to
    // find them.
    let has_no_numbers = |candidate: &Candidate| {
        let card = candidate.effects.last().and_then(|effect| effect.card);
        card.is_some_and(|card| card.parameters.is_empty())
    };
    scored.retain(|((group, candidate), _)| {
        taken[*group] += 1;
        taken[*group] <= most || has_no_numbers(candidate)
    });
    let (candidates, scored): (Vec<&Candidate>, Vec<StartingPoints>) =
        scored.into_iter().map(|((_, candidate), starting_points)| (candidate, starting_points)).unzip();
    // A fit on all data does not ask for it.
    let goal = scored.first().map(StartingPoints::cost).filter(|_| !fits_briefly_on_all(split));
    let scored = candidates.iter().copied().zip(scored).collect();
    let fitted =
        looks.of(scored, LookDepth::BriefFit(goal.map(f64::to_bits)), |candidate, starting_points| {
            candidate.fit_briefly(starting_points, split, goal)
        });
    let mut promising: Vec<(&Candidate, StartingPoints)> = candidates.into_iter().zip(fitted).collect();
    promising.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
    promising.truncate(finished);
    promising.retain(|(_, starting_points)| {
        !(starting_points.is_fitted_on_all() && starting_points.cost() > limit)
    });
    spread_out(promising, |(candidate, starting_points)| {
        reported(candidate.finish(starting_points, split), split, progress)
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::split;
    use super::*;
    use crate::model::Model;

    /// What is out of reach after a while is not fitted to the end.
    #[test]
    fn a_set_beyond_the_limit_is_not_fitted_to_the_end() {
        let (model, split) = (Model::paper(), split());
        let base = vec!["steady_rate_linear".to_owned()];
        let candidate = Candidate {
            from: &model,
            nominal: &model,
            effects: Vec::new(),
            base,
            known: &[],
            without: Some(f64::INFINITY),
        };
        let cost = candidate.run(&split).fit.cost;
        assert!(cost > 0.0, "a rotor that answers at once is none of the model");
        for (share, fitted) in [(0.9, 0), (1.1, 1)] {
            let finalists = Finalists { limit: share * cost, ..Finalists::of((1, 1)) };
            let fits = run_promising(
                &[vec![candidate.clone()]],
                finalists,
                (&split, &mut LookCache::default()),
                &|_: SearchEvent| (),
            );
            assert_eq!(fits.len(), fitted, "{share} of what it leaves");
        }
    }

    #[test]
    fn a_law_without_numbers_is_left_out_by_no_first_look() {
        let (model, split) = (Model::paper(), split());
        let known = model.known_effects().expect("the catalogue");
        let with = |id: &str| Candidate {
            from: &model,
            nominal: &model,
            effects: known.iter().filter(|effect| effect.id == id).collect(),
            base: Vec::new(),
            known: &known,
            without: None,
        };
        let group = ["transport_delay", "battery_scaling"].map(with).to_vec();
        let finalists = Finalists::of((0, 2));
        let looks = &mut LookCache::default();
        let fits = run_promising(&[group], finalists, (&split, looks), &|_: SearchEvent| ());
        assert_eq!(fits.iter().map(|fitted| &fitted.effects[..]).collect::<Vec<_>>(), [["battery_scaling"]]);
    }
}
