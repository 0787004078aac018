//! Answers of searches as the page shows them: made once, when a search ends.

use serde_json::{Map, Value, json};

use super::desk::{Answered, Desk, SearchInputs};
use crate::diagnose::Diagnosis;
use crate::diagnose::diagnosis::RankedCandidate;
use crate::discover::Discovery;
use crate::effect::{CATALOGUE, Card};
use crate::report::findings::sentences;
use crate::report::next_steps::NextStep;
use crate::report::{discovery, json as answer_json, not_named, verdict};

/// What `diagnose` said; `next` is what to do.
pub(super) fn of_diagnosis(it: &Diagnosis, next: &[NextStep]) -> Value {
    let own = it.model.user_effects.iter().map(|effect| {
        (effect.id.clone(), json!({ "meaning": effect.meaning, "equation": effect.expression }))
    });
    json!({
        "verdict": it.verdict,
        "sentence": verdict::sentence(it, "").replace('`', ""),
        "is_of_other_bench": verdict::is_of_other_bench(it),
        "effects": it.effects,
        "alternatives": it.alternatives.iter().chain(&it.further_alternatives).collect::<Vec<_>>(),
        "common": verdict::common(it, "").filter(|_| !verdict::says_common(it)),
        "error": it.error,
        "unit": it.error.unit,
        "candidates": it.candidates.iter().map(candidate).collect::<Vec<_>>(),
        "cards": own.collect::<Map<_, _>>(),
        "findings": sentences(&it.findings),
        "fall": fall(it),
        "next": next.iter().map(|it| json!({ "words": it.words, "command": it.command })).collect::<Vec<_>>(),
    })
}

/// How far the held-out error falls with the named effects; `null` where none is named.
fn fall(it: &Diagnosis) -> Value {
    if it.effects.is_empty() {
        return Value::Null;
    }
    let error = &it.error;
    json!({
        "channel": error.channel,
        "before": error.without_effects(),
        "after": error.extended.validate,
        "floor": error.noise_floor,
        "explained": error.explained(),
    })
}

/// What `discover` said, its own JSON among it, and the command that says it.
pub(super) fn of_law(it: &Discovery, by_hand: &str) -> Value {
    let (found, why) = match answer_json::with_sentences(it, &it.findings) {
        Ok(found) => (found, None),
        Err(error) => (Value::Null, Some(error.to_string())),
    };
    json!({
        "verdict": it.verdict,
        "sentence": discovery::headline(it, "").replace('`', ""),
        "beneath": discovery::beneath(it),
        "unit": it.error.unit,
        "found": found,
        "why": why,
        "by_hand": by_hand,
    })
}

/// An answer as it is now: of other logs, or of a model that is no longer chosen, it says nothing of what is to be seen.
pub(super) fn shown(desk: &Desk, answered: &Answered) -> Value {
    let mut shown = Value::clone(&answered.shown);
    shown["model"] = json!(desk.model(answered.of.model).ok().map(|model| &model.model.name));
    shown["is_current"] = json!(answered.of == SearchInputs::of(desk));
    if let Some(cards) = shown.get_mut("cards").and_then(Value::as_object_mut) {
        cards.extend(CATALOGUE.iter().map(|it| (it.id.to_owned(), card(it))));
    }
    shown
}

pub(super) fn card(card: &Card) -> Value {
    json!({
        "id": card.id,
        "meaning": card.meaning,
        "equation": card.equation,
        "source": card.source,
        "report": card.report,
        "residual": card.residual,
        "confused_with": card.confused_with,
        "experiment": card.experiment,
    })
}

fn candidate(candidate: &RankedCandidate) -> Value {
    json!({
        "effect": candidate.effect,
        "channel": candidate.channel,
        "validate": candidate.validate,
        "chance": candidate.p_value,
        "drop_one": candidate.drop_one,
        "why": candidate.refusal.as_ref().map(ToString::to_string),
        "not_named": candidate.not_named.as_ref().map(not_named::words),
    })
}
