//! Candidates fitted on every core.

use super::candidate::StartingPoints;
use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
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

/// Of the most promising `most` of each group of candidates, by a look at a part of the data, runs those `finished` to the end
/// that are best when they have been fitted for a while.
pub fn run_promising(
    groups: &[Vec<Candidate>],
    (most, finished): (usize, usize),
    split: &DataSplit,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Vec<CandidateFit> {
    let all: Vec<(usize, &Candidate)> = groups
        .iter()
        .enumerate()
        .flat_map(|(group, candidates)| candidates.iter().map(move |candidate| (group, candidate)))
        .collect();
    let scored = spread(&all, |(_, candidate)| {
        progress(SearchEvent::Fitted);
        candidate.starting_points(split)
    });
    let mut scored: Vec<((usize, &Candidate), StartingPoints)> = all.into_iter().zip(scored).collect();
    scored.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
    let mut taken = vec![0; groups.len()];
    scored.retain(|((group, _), _)| {
        taken[*group] += 1;
        taken[*group] <= most
    });
    let mut promising: Vec<(&Candidate, StartingPoints)> =
        scored.into_iter().map(|((_, candidate), starting_points)| (candidate, starting_points)).collect();
    let goal = promising.first().map_or(0.0, |(_, starting_points)| starting_points.cost());
    promising = spread_out(promising, |(candidate, starting_points)| {
        (candidate, candidate.fit_briefly(starting_points, split, Some(goal)))
    });
    promising.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
    promising.truncate(finished);
    spread_out(promising, |(candidate, starting_points)| {
        reported(candidate.finish(starting_points, split), split, progress)
    })
}
