//! Candidates fitted on every core.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::candidate::{Candidate, StartingPoints};
use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::progress::Event;
use super::thresholds::THRESHOLDS;
use crate::cancel::{self, Cancel};

/// Fits candidates on every core; `progress` hears of each.
pub fn run_all(
    candidates: &[Candidate],
    split: &DataSplit,
    progress: &(dyn Fn(Event) + Sync),
) -> Vec<CandidateFit> {
    spread(candidates, |candidate| {
        let fitted = candidate.run(split);
        progress(Event::Fitted);
        fitted
    })
}

/// Runs effects one by one. A body's are fitted on a part of the data first, where there are many, and those that leave
/// far more than the best one are not fitted to the last digit.
pub fn run_singles(
    candidates: &[Candidate],
    split: &DataSplit,
    progress: &(dyn Fn(Event) + Sync),
) -> Vec<CandidateFit> {
    if split.train.is_rotor() || split.coarse.is_none() {
        return run_all(candidates, split, progress);
    }
    let fitted_briefly = spread(candidates, |candidate| {
        progress(Event::Fitted);
        candidate.fit_briefly(candidate.starting_points(split), split, None)
    });
    let best = fitted_briefly.iter().map(StartingPoints::cost).fold(f64::INFINITY, f64::min);
    each(candidates.iter().zip(fitted_briefly).collect(), |candidate, starting_points| {
        let is_near = starting_points.cost() <= THRESHOLDS.hopeless_single * best;
        candidate.finish(if is_near { starting_points.with_full_fit() } else { starting_points }, split)
    })
}

/// Of the most promising `most` of each group of candidates, by a look at a part of the data, runs those `finished` to the end
/// that are best when they have been fitted for a while.
pub fn run_promising(
    groups: &[Vec<Candidate>],
    (most, finished): (usize, usize),
    split: &DataSplit,
    progress: &(dyn Fn(Event) + Sync),
) -> Vec<CandidateFit> {
    let all: Vec<(usize, &Candidate)> = groups
        .iter()
        .enumerate()
        .flat_map(|(group, candidates)| candidates.iter().map(move |candidate| (group, candidate)))
        .collect();
    let scored = spread(&all, |(_, candidate)| {
        progress(Event::Fitted);
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
    promising = each(promising, |candidate, starting_points| {
        (candidate, candidate.fit_briefly(starting_points, split, Some(goal)))
    });
    promising.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
    promising.truncate(finished);
    each(promising, |candidate, starting_points| candidate.finish(starting_points, split))
}

/// Does the work for every candidate and its starting points, on every core.
fn each<'p, R: Send>(
    candidates: Vec<(&'p Candidate<'p>, StartingPoints)>,
    work: impl Fn(&'p Candidate<'p>, StartingPoints) -> R + Sync,
) -> Vec<R> {
    let items: Vec<(&Candidate, Mutex<Option<StartingPoints>>)> = candidates
        .into_iter()
        .map(|(candidate, starting_points)| (candidate, Mutex::new(Some(starting_points))))
        .collect();
    let done = spread(&items, |(candidate, starting_points)| {
        let starting_points = starting_points.lock().unwrap_or_else(PoisonError::into_inner).take();
        starting_points.map(|starting_points| work(candidate, starting_points))
    });
    done.into_iter().flatten().collect()
}

/// Does the work for every item, on every core; answers in the items' order. The workers hear of the same wish to end as
/// their caller, who is left as they are.
pub(crate) fn spread<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let answers: Mutex<Vec<(usize, R)>> = Mutex::new(Vec::with_capacity(items.len()));
    let cores =
        std::thread::available_parallelism().map_or(1, std::num::NonZero::get).min(items.len().max(1));
    let token = Cancel::current();
    let take_turns = || {
        loop {
            cancel::check();
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { break };
            let answer = work(item);
            answers.lock().unwrap_or_else(PoisonError::into_inner).push((index, answer));
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(|| token.during(take_turns))).collect();
        let left = workers.into_iter().filter_map(|worker| worker.join().err()).collect::<Vec<_>>();
        if let Some(reason) = left.into_iter().next() {
            std::panic::resume_unwind(reason);
        }
    });
    let mut answers = answers.into_inner().unwrap_or_else(PoisonError::into_inner);
    answers.sort_by_key(|(index, _)| *index);
    answers.into_iter().map(|(_, answer)| answer).collect()
}
