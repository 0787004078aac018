//! Which condition each candidate failed that was tried and is not named.

use super::candidate_fit::CandidateFit;
use super::model_selection::{over_floor, same_set, shortfall, unidentified};
use super::not_named::{NotNamed, Unmet};
use super::search_result::{SearchResult, SingleEffect};
use crate::model::Effect;

/// Tells each single effect of `found` that is not in `best` what it failed. `fits` are the sets that were tried: beside `best`
/// where that was, else alone.
pub(crate) fn judge(found: &mut SearchResult, best: &CandidateFit, fits: &[CandidateFit], known: &[Effect]) {
    let reasons: Vec<Option<NotNamed>> =
        found.singles.iter().map(|single| reason(found, best, fits, known, single)).collect();
    found.singles.iter_mut().zip(reasons).for_each(|(single, reason)| single.not_named = reason);
}

fn reason(
    found: &SearchResult,
    best: &CandidateFit,
    fits: &[CandidateFit],
    known: &[Effect],
    single: &SingleEffect,
) -> Option<NotNamed> {
    let fitted = single.fitted.as_ref().filter(|_| single.refusal.is_none())?;
    let split = &found.split;
    if best.effects.contains(&single.effect) {
        return None;
    }
    // What it gains comes first: of a law that gains nothing no number is determined either.
    let unmet = |before: &CandidateFit, after: &CandidateFit| {
        let condition = shortfall(split, before, after).or_else(|| unidentified(split, after, known));
        condition.map(|condition| NotNamed { beside: before.effects.clone(), condition })
    };
    let set = [&best.effects[..], std::slice::from_ref(&single.effect)].concat();
    let beside = |condition| NotNamed { beside: best.effects.clone(), condition };
    let tried = fits.iter().find(|fitted| same_set(&fitted.effects, &set));
    let failed = match tried {
        _ if best.effects.is_empty() => unmet(&found.refitted, fitted),
        Some(with) => unmet(best, with),
        None => unmet(&found.refitted, fitted).or_else(|| {
            let is_at_floor = over_floor(split, best, &found.floors).0 <= found.at_floor();
            is_at_floor.then(|| beside(Unmet::NothingLeft))
        }),
    };
    Some(failed.unwrap_or_else(|| beside(Unmet::LessThanAnother)))
}

/// The same in the light of the whole answer, which names `named`: what the body says of its rotors may have changed it since.
pub(crate) fn in_answer(found: &SearchResult, named: &[String], single: &SingleEffect) -> Option<NotNamed> {
    let is_judged = single.fitted.is_some() && single.refusal.is_none();
    if !is_judged || named.contains(&single.effect) {
        return None;
    }
    let beside = |condition| NotNamed { beside: Vec::new(), condition };
    match found
        .alternatives
        .iter()
        .chain(&found.two_for_one)
        .find(|other| other.effects.contains(&single.effect))
    {
        Some(other) => Some(beside(Unmet::Indistinguishable { set: other.effects.clone() })),
        None => Some(single.not_named.clone().unwrap_or_else(|| beside(Unmet::BodyDecides))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::*;

    /// A set of effects beside which this share of a trace is left.
    fn set(effects: &[&str], left: f64) -> CandidateFit {
        let residuals = (0..ROWS).map(|row| noise(row) + left * noise(row + 100_000)).collect();
        CandidateFit { effects: effects.iter().map(|id| (*id).to_owned()).collect(), ..leaves(residuals) }
    }

    /// A block whose candidate `other` leaves `left`, and what is said of it where `best` was found among `fits`.
    fn said(
        left: f64,
        best: &CandidateFit,
        fits: &[CandidateFit],
        floor: f64,
    ) -> (SearchResult, Option<NotNamed>) {
        let other = SingleEffect {
            effect: "other".to_owned(),
            fitted: Some(set(&["other"], left)),
            surrogate: None,
            refusal: None,
            not_named: None,
        };
        let mut found = SearchResult {
            split: split(),
            nominal: set(&[], 1.0),
            refitted: set(&[], 1.0),
            singles: vec![other],
            answer: best.clone(),
            ladder: Vec::new(),
            alternatives: Vec::new(),
            two_for_one: Vec::new(),
            dropped: Vec::new(),
            floors: [floor; 2],
            changed: Vec::new(),
            shifts: Vec::new(),
        };
        judge(&mut found, best, fits, &[]);
        let reason = in_answer(&found, &found.answer.effects, &found.singles[0]);
        (found, reason)
    }

    fn beside(effects: &[&str], condition: Unmet) -> Option<NotNamed> {
        Some(NotNamed { beside: effects.iter().map(|id| (*id).to_owned()).collect(), condition })
    }

    #[test]
    fn beside_the_answer_where_that_was_tried_and_else_alone() {
        let (base, named) = (set(&[], 1.0), set(&["named"], 0.0));
        let alone = said(1.0, &base, &[], 1.0).1;
        assert_eq!(alone, beside(&[], Unmet::TooLittle { share: 0.0, needed: 0.03 }));
        assert_eq!(said(1.0, &named, &[], 1.0).1, alone, "the pair was not tried");
        let pair = set(&["other", "named"], 0.0);
        let together = said(0.1, &named, &[pair], 1.0).1;
        assert_eq!(together, beside(&["named"], Unmet::TooLittle { share: 0.0, needed: 0.03 }));
    }

    #[test]
    fn what_passes_by_itself_yields_to_a_set_that_leaves_less() {
        let named = set(&["named"], 0.0);
        assert_eq!(said(0.1, &named, &[], 1.0).1, beside(&["named"], Unmet::NothingLeft));
        assert_eq!(said(0.1, &named, &[], 0.5).1, beside(&["named"], Unmet::LessThanAnother));
    }

    #[test]
    fn the_whole_answer_has_the_last_word() {
        let (mut found, _) = said(0.1, &set(&["other"], 0.1), &[], 1.0);
        assert_eq!(in_answer(&found, &found.answer.effects, &found.singles[0]), None, "it is named");
        found.answer = set(&["named"], 0.0);
        assert_eq!(
            in_answer(&found, &found.answer.effects, &found.singles[0]),
            beside(&[], Unmet::BodyDecides)
        );
        found.alternatives.push(set(&["other"], 0.0));
        let same = Unmet::Indistinguishable { set: vec!["other".to_owned()] };
        assert_eq!(in_answer(&found, &found.answer.effects, &found.singles[0]), beside(&[], same));
        found.two_for_one = vec![set(&["other", "second"], 0.0)];
        found.alternatives.clear();
        let same = Unmet::Indistinguishable { set: vec!["other".to_owned(), "second".to_owned()] };
        assert_eq!(in_answer(&found, &found.answer.effects, &found.singles[0]), beside(&[], same));
        found.singles[0].fitted = None;
        assert_eq!(in_answer(&found, &found.answer.effects, &found.singles[0]), None, "it was not tried");
    }
}
