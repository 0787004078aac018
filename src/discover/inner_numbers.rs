//! The inner numbers of a law moved to where one step does best, before the whole simulation refits it: a wave that is off by half a
//! radian at the ends of its range starts in another valley than the one that it belongs to.

use super::law::CandidateLaw;
use super::linear::{LinearizedBlock, Score};
use super::thresholds::THRESHOLDS;

/// The law with its inner numbers moved, one after the other, and what one step with it does.
pub(crate) fn polished(linear: &LinearizedBlock, law: &CandidateLaw, score: &Score) -> (CandidateLaw, Score) {
    let mut best = (law.clone(), score.clone());
    let mut share = 1.0;
    for _ in 0..THRESHOLDS.inner_rounds {
        for term in 0..law.terms.len() {
            for inner in 0..law.terms[term].inner.len() {
                move_one(linear, &mut best, (term, inner), share);
            }
        }
        share /= THRESHOLDS.inner_shrink;
    }
    best
}

/// Moves one number to the best of three places beside it: a step up, a step down, and where the parabola through these has its
/// lowest point.
fn move_one(
    linear: &LinearizedBlock,
    best: &mut (CandidateLaw, Score),
    (term, inner): (usize, usize),
    share: f64,
) {
    let from = best.0.terms[term].inner[inner].clone();
    let here = best.1.loss();
    let step = share * from.step;
    let mut tried = |offset: f64| -> Option<f64> {
        let mut law = best.0.clone();
        let value = (from.value + offset).clamp(from.bounds.0, from.bounds.1);
        law.terms[term].inner[inner].value = value;
        let score = linear.score(&linear.columns(&law)?, 0.0)?;
        let loss = score.loss();
        if loss < best.1.loss() {
            *best = (law, score);
        }
        Some(loss)
    };
    let (Some(up), Some(down)) = (tried(step), tried(-step)) else { return };
    let bend = up + down - 2.0 * here;
    let lowest = 0.5 * step * (down - up) / bend;
    if bend > 0.0 && lowest.abs() < step {
        tried(lowest);
    }
}
