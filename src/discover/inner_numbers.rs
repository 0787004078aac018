//! The inner numbers of a law moved to where one step does best, before the whole simulation refits it: a wave that is off by half a
//! radian at the ends of its range starts in another valley than the one that it belongs to.

use super::law::{CandidateLaw, Inner, LawTerm};
use super::linear::{LinearizedBlock, Score};
use super::thresholds::THRESHOLDS;

/// The law with its inner numbers moved, one after the other, and what one step with it does.
pub(crate) fn polished(linear: &LinearizedBlock, law: &CandidateLaw, score: &Score) -> (CandidateLaw, Score) {
    let mut best = (law.clone(), score.clone());
    let jumps = law.terms.iter().any(LawTerm::jumps);
    let rounds = if jumps { THRESHOLDS.jump_rounds } else { THRESHOLDS.inner_rounds };
    let mut share = 1.0;
    for _ in 0..rounds {
        for term in 0..law.terms.len() {
            for way in ways(&law.terms[term]) {
                move_along(linear, &mut best, (term, &way), share);
            }
        }
        share /= THRESHOLDS.inner_shrink;
    }
    best
}

/// By how much each inner number of a term moves at a time: one of them by its step, of a relay one of its two thresholds.
fn ways(term: &LawTerm) -> Vec<Vec<f64>> {
    if let ([half, middle], true) = (&term.inner[..], term.jumps()) {
        let step = 0.5 * half.step.max(middle.step);
        return vec![vec![step, step], vec![step, -step]];
    }
    let one = |moved: usize| {
        let of = |(at, inner): (usize, &Inner)| if at == moved { inner.step } else { 0.0 };
        term.inner.iter().enumerate().map(of).collect()
    };
    (0..term.inner.len()).map(one).collect()
}

/// Moves a term's numbers to the best of three places along a way: a step up, a step down, and where the parabola through these has
/// its lowest point.
fn move_along(
    linear: &LinearizedBlock,
    best: &mut (CandidateLaw, Score),
    (term, way): (usize, &[f64]),
    share: f64,
) {
    let from = best.0.terms[term].inner.clone();
    let here = best.1.loss();
    let mut tried = |times: f64| -> Option<f64> {
        let mut law = best.0.clone();
        for ((inner, from), step) in law.terms[term].inner.iter_mut().zip(&from).zip(way) {
            inner.value = (from.value + times * share * step).clamp(from.bounds.0, from.bounds.1);
        }
        let score = linear.score(&linear.columns(&law)?, 0.0)?;
        let loss = score.loss();
        if loss < best.1.loss() {
            *best = (law, score);
        }
        Some(loss)
    };
    let (Some(up), Some(down)) = (tried(1.0), tried(-1.0)) else { return };
    let bend = up + down - 2.0 * here;
    let lowest = 0.5 * (down - up) / bend;
    if bend > 0.0 && lowest.abs() < 1.0 {
        tried(lowest);
    }
}

#[cfg(test)]
mod tests {
    use super::super::channels::LawInput;
    use super::super::forms::{of_memory, of_one};
    use super::*;
    use crate::effect::Site;

    /// Of a relay one threshold moves, and the other stays; elsewhere one number does.
    #[test]
    fn one_number_moves_at_a_time_and_of_a_relay_one_threshold() {
        let (signal, log, unit) = ("body_angle", "body_angle_rad", "rad");
        let angle = LawInput { signal, log, unit, low: -0.4, high: 0.4, is_signed: true };
        let relays = of_memory(Site::Torque, &angle);
        let relay = relays.iter().find(|term| term.form == "relay").expect("in the library");
        let [up, down] = &ways(relay)[..] else { panic!("two thresholds") };
        assert!(up[0] > 0.0 && up[0] == up[1], "the middle less the half stays: {up:?}");
        assert!(down[0] > 0.0 && down[0] == -down[1], "the middle and the half stay: {down:?}");
        let stribeck = of_one(&angle, &[]).into_iter().find(|term| term.form == "stribeck");
        let found = ways(&stribeck.expect("in the library"));
        assert!(found.len() == 2 && found[0][1] == 0.0 && found[1][0] == 0.0, "{found:?}");
    }
}
