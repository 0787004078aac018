//! Plans carried out on every core.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::candidate::{Glance, Plan};
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::progress::Event;
use crate::cancel::{self, Cancel};

/// An effect that leaves so many times the squares that another one leaves is no answer, and no start of a good one.
const FAR: f64 = 4.0;

/// Runs plans on every core; `progress` hears of each.
pub fn run_all(plans: &[Plan], stage: &Stage, progress: &(dyn Fn(Event) + Sync)) -> Vec<Trial> {
    spread(plans, |plan| {
        let trial = plan.run(stage);
        progress(Event::Fitted);
        trial
    })
}

/// Runs effects one by one. A body's are followed on a part of the data first, where there are many, and those that leave
/// far more than the best one are not followed to the last digit.
pub fn run_singles(plans: &[Plan], stage: &Stage, progress: &(dyn Fn(Event) + Sync)) -> Vec<Trial> {
    if stage.train.is_rotor() || stage.coarse.is_none() {
        return run_all(plans, stage, progress);
    }
    let sketched = spread(plans, |plan| {
        progress(Event::Fitted);
        plan.sketch(plan.glance(stage), stage, None)
    });
    let best = sketched.iter().map(Glance::cost).fold(f64::INFINITY, f64::min);
    each(plans.iter().zip(sketched).collect(), |plan, glance| {
        let is_near = glance.cost() <= FAR * best;
        plan.finish(if is_near { glance.followed_to_the_end() } else { glance }, stage)
    })
}

/// Of the most promising `most` of each group of plans, by a look at a part of the data, runs those `finished` to the end
/// that are best when they have been followed for a while.
pub fn run_promising(
    groups: &[Vec<Plan>],
    (most, finished): (usize, usize),
    stage: &Stage,
    progress: &(dyn Fn(Event) + Sync),
) -> Vec<Trial> {
    let all: Vec<(usize, &Plan)> = groups
        .iter()
        .enumerate()
        .flat_map(|(group, plans)| plans.iter().map(move |plan| (group, plan)))
        .collect();
    let looked = spread(&all, |(_, plan)| {
        progress(Event::Fitted);
        plan.glance(stage)
    });
    let mut looked: Vec<((usize, &Plan), Glance)> = all.into_iter().zip(looked).collect();
    looked.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
    let mut taken = vec![0; groups.len()];
    looked.retain(|((group, _), _)| {
        taken[*group] += 1;
        taken[*group] <= most
    });
    let mut promising: Vec<(&Plan, Glance)> =
        looked.into_iter().map(|((_, plan), glance)| (plan, glance)).collect();
    let goal = promising.first().map_or(0.0, |(_, glance)| glance.cost());
    promising = each(promising, |plan, glance| (plan, plan.sketch(glance, stage, Some(goal))));
    promising.sort_by(|a, b| a.1.cost().total_cmp(&b.1.cost()));
    promising.truncate(finished);
    each(promising, |plan, glance| plan.finish(glance, stage))
}

/// Does the work for every plan and what was seen of it, on every core.
fn each<'p, R: Send>(
    plans: Vec<(&'p Plan<'p>, Glance)>,
    work: impl Fn(&'p Plan<'p>, Glance) -> R + Sync,
) -> Vec<R> {
    let items: Vec<(&Plan, Mutex<Option<Glance>>)> =
        plans.into_iter().map(|(plan, glance)| (plan, Mutex::new(Some(glance)))).collect();
    let done = spread(&items, |(plan, glance)| {
        let glance = glance.lock().unwrap_or_else(PoisonError::into_inner).take();
        glance.map(|glance| work(plan, glance))
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
