//! The story of `diagnose` and `extend` on one screen of text, 80 columns wide.

use std::fmt::Write as _;

pub(super) use super::wrapped::wrapped;
use super::{Mark, TextTable, number};
use crate::diagnose::Extension;
use crate::diagnose::diagnosis::{
    Diagnosis, ErrorSummary, FailurePlace, FoundParameter, RankedCandidate, TrainValidate, Verdict,
};
use crate::effect::find;
use crate::model::{Model, ModelStep};
use crate::report::card_sentence::{card_sentence, in_doubt};
use crate::report::findings::sentence;
use crate::report::found_parameters::found_parameters;
use crate::report::measure::measure;
use crate::report::next_steps::NextStep;
use crate::report::not_named;
use crate::report::notes::{self, Detail};
use crate::report::thresholds::THRESHOLDS;
use crate::report::verdict;
use crate::screening::Finding;

/// Candidates that a short answer shows beside those that are named, and where none is.
const SHOWN_BESIDE: usize = 2;
const SHOWN_OF_NONE: usize = 6;
/// So many changed numbers stand on lines of their own in a short answer.
const MOST_CHANGED_LINES: usize = 3;

/// `value ± error unit`; a bare number carries no unit.
pub(super) fn measured(value: f64, error: Option<f64>, unit: &str) -> String {
    let error = error.map_or(String::new(), |error| format!(" ± {}", number(error, 2)));
    let unit = if unit == "-" || unit.is_empty() { String::new() } else { format!(" {unit}") };
    format!("{}{error}{unit}", number(value, 5))
}

/// Whether k_V is among numbers that have changed.
pub(super) fn moves_voltage_gain<'a>(mut names: impl Iterator<Item = &'a String>) -> bool {
    names.any(|name| name == "voltage_gain")
}

/// The card of an effect in a few lines, with its parameters as found; of the user's own what the model file says of it.
fn card<'a>(
    id: &str,
    base: (&Model, bool),
    parameters: impl Iterator<Item = (&'a String, &'a FoundParameter)> + Clone,
    not_known: &[&str],
) -> String {
    let card = find(id);
    let (equation, meaning) = match (card, base.0.user_effect(id)) {
        (Some(card), _) => {
            let doubt = in_doubt(base, card, parameters.clone());
            (format!("  {}", card.equation), card_sentence(card, doubt))
        }
        (None, Some(user)) => (format!("  + {}", user.expression), user.meaning.clone()),
        (None, None) => (String::new(), String::new()),
    };
    let mut out = format!("  {id}{equation}\n");
    if !meaning.is_empty() {
        out += &wrapped("    ", &meaning);
    }
    for (name, found) in parameters {
        let Some(bare) = name.strip_prefix(id).and_then(|rest| rest.strip_prefix('.')) else { continue };
        let symbol = card
            .and_then(|card| card.parameters.iter().find(|parameter| parameter.name == bare))
            .map_or(String::new(), |parameter| format!(" ({})", parameter.symbol));
        let value = measured(found.value, found.standard_error, &found.unit);
        let doubt = if not_known.contains(&name.as_str()) { NOT_KNOWN } else { "" };
        let _ = writeln!(out, "    {bare}{symbol} = {value}{doubt}");
    }
    out
}

/// Behind a number whose effect is there, and whose size these logs do not tell.
const NOT_KNOWN: &str = ", so how large is not known";

/// The equation and the meaning of an effect.
pub(super) fn effect_card(id: &str, model: &Model) -> String {
    card(id, (model, false), std::iter::empty(), &[])
}

/// `least to greatest unit`, or one number where both are the same in what is shown.
pub(super) fn in_range(least: f64, greatest: f64, unit: &str) -> String {
    let (low, high) = (number(least, 4), number(greatest, 4));
    let unit = if unit == "-" || unit.is_empty() { String::new() } else { format!(" {unit}") };
    if low == high { format!("{low}{unit}") } else { format!("{low} to {high}{unit}") }
}

/// The errors of a story, one line each.
pub(super) fn errors(error: &ErrorSummary) -> String {
    let unit = error.unit;
    let headers = ["model".to_owned(), format!("fitted on [{unit}]"), format!("held out [{unit}]")];
    let mut out =
        wrapped("", &format!("Error: {}", measure(&error.measure))) + &error_table(error, headers).text();
    if error.is_refitted_worse() {
        out += &wrapped("", REFITTED_WORSE);
    }
    out
}

/// Why the refitted baseline may do worse than the nominal one on what was held out.
pub(super) const REFITTED_WORSE: &str = "Refitted on one part and validated on another it does worse than as it is: the parts ask \
for other numbers, or its own came from these very data.";

/// The errors of the model as it is, refitted and extended, beside the noise floor.
pub(super) fn error_table<H: Into<String>>(error: &ErrorSummary, headers: [H; 3]) -> TextTable {
    let row =
        |name: &str, both: TrainValidate| [name.to_owned(), number(both.train, 4), number(both.validate, 4)];
    TextTable::new(headers)
        .row(row("as it is", error.base))
        .row(row("its own parameters refitted", error.refitted))
        .marked_row(Mark::Good, row("extended", error.extended))
        .row(["noise floor".to_owned(), String::new(), number(error.noise_floor, 4)])
}

/// How many candidates an answer shows, of `all`: those that were named, and the best beside them.
fn shown_of(diagnosis: &Diagnosis, all: usize, detail: Detail) -> usize {
    match detail {
        Detail::Short if diagnosis.effects.is_empty() => SHOWN_OF_NONE,
        Detail::Short => diagnosis.effects.len() + SHOWN_BESIDE,
        Detail::Every => all,
    }
}

/// Those that are in the channel that the error is given in: errors of different blocks have different units.
fn candidates(diagnosis: &Diagnosis, detail: Detail) -> String {
    let is_of_error = |candidate: &&RankedCandidate| {
        let is_tried = candidate.refusal.is_none() || candidate.validate.is_some();
        is_tried && diagnosis.error.is_of(&candidate.channel)
    };
    let mut candidates: Vec<_> = diagnosis.candidates.iter().filter(is_of_error).collect();
    if candidates.is_empty() {
        return String::new();
    }
    let held_out = |value: Option<f64>| value.unwrap_or(f64::INFINITY);
    candidates.sort_by(|a, b| held_out(a.validate).total_cmp(&held_out(b.validate)));
    // Those that were named come first, the best of the others behind them.
    candidates.sort_by_key(|candidate| !diagnosis.effects.contains(&candidate.effect));
    let unit = diagnosis.error.unit;
    let mut table = TextTable::new([
        "effect".to_owned(),
        format!("alone [{unit}]"),
        format!("all without it [{unit}]"),
        "p-value".to_owned(),
    ]);
    let cell = |value: Option<f64>, digits| value.map_or("-".to_owned(), |value| number(value, digits));
    let shown = shown_of(diagnosis, candidates.len(), detail);
    let more = match candidates.len().saturating_sub(shown) {
        0 => String::new(),
        more => wrapped("", &format!("{more} more took off less (--notes lists them)")),
    };
    candidates.truncate(shown);
    let mut refused = String::new();
    for candidate in &candidates {
        if let Some(why) = &candidate.refusal {
            refused += &wrapped("  ", &format!("{} is refused: {why}", candidate.effect));
        }
        table = table.row([
            candidate.effect.clone(),
            cell(candidate.validate, 4),
            cell(candidate.drop_one, 4),
            cell(candidate.p_value, 2),
        ]);
    }
    let head = format!(
        "Held-out error with one effect alone (refitted without any: {} {unit}); p-value: how often a meaningless one does as well \
         alone",
        number(diagnosis.error.refitted.validate, 4)
    );
    let table = table.text();
    format!("\n{}{table}{more}{refused}{}", wrapped("", &head), not_named(&candidates, detail))
}

/// Effects that nobody knows anything of, by why.
fn not_tried(diagnosis: &Diagnosis, detail: Detail) -> String {
    let untried = diagnosis.candidates.iter().filter(|candidate| candidate.validate.is_none());
    let reason = |it: &RankedCandidate| it.refusal.as_ref().map(ToString::to_string);
    by_reason("Not tried: ", untried.filter_map(|it| Some((it.effect.as_str(), reason(it)?))), detail)
}

/// Effects of those shown that were tried and are not named, by the condition that they failed.
fn not_named(shown: &[&RankedCandidate], detail: Detail) -> String {
    let reason = |it: &RankedCandidate| Some(not_named::words(it.not_named.as_ref()?));
    by_reason("Not named: ", shown.iter().filter_map(|it| Some((it.effect.as_str(), reason(it)?))), detail)
}

/// A line for each reason, with all effects that have it; of a short answer one line, with the reason where all have one.
fn by_reason<'a>(first: &str, effects: impl Iterator<Item = (&'a str, String)>, detail: Detail) -> String {
    let mut reasons: Vec<(String, Vec<&str>)> = Vec::new();
    for (effect, reason) in effects {
        match reasons.iter_mut().find(|(why, _)| *why == reason) {
            Some((_, effects)) => effects.push(effect),
            None => reasons.push((reason, vec![effect])),
        }
    }
    if detail == Detail::Short && reasons.len() > 1 {
        let effects = reasons.into_iter().flat_map(|(_, effects)| effects).collect();
        reasons = vec![("why: --notes".to_owned(), effects)];
    }
    let line =
        |(why, effects): (String, Vec<&str>)| wrapped(first, &format!("{} ({why})", effects.join(", ")));
    reasons.into_iter().map(line).collect()
}

/// A diagnosis; `next` says what to do, `detail` how much of the notes is said.
#[must_use]
pub fn diagnosis(diagnosis: &Diagnosis, next: &[NextStep], detail: Detail) -> String {
    let mut out = wrapped("", &verdict::sentence(diagnosis, "").replace('`', ""));
    for said in verdict::beneath(diagnosis, "") {
        out += &wrapped("", &said);
    }
    let moved = moves_voltage_gain(diagnosis.changed_parameters.iter().map(|changed| &changed.name));
    for id in &diagnosis.effects {
        out += &card(id, (&diagnosis.model, moved), diagnosis.parameters.iter(), &not_known(diagnosis));
    }
    out += &changed_numbers(diagnosis, detail);
    if let Some(reservation) = verdict::reservation(diagnosis) {
        out += &wrapped("  ", reservation);
    }
    out.push('\n');
    out += &errors(&diagnosis.error);
    out += &places(diagnosis);
    out += &candidates(diagnosis, detail);
    out += &not_tried(diagnosis, detail);
    out.push('\n');
    for step in next {
        // A command stays on one line, to be copied.
        match &step.command {
            Some(command) => {
                let _ = writeln!(out, "Next: {}\n  {command}", step.words);
            }
            None => out += &wrapped("Next: ", &step.words.replace('`', "")),
        }
    }
    // What stands behind a number already is not said again.
    let is_new = |finding: &&Finding| detail == Detail::Every || finding.code != PARAMETER_NOT_KNOWN;
    out + &notes::lines(&notes::of_all(verdict::notes(diagnosis).filter(is_new)), "Note: ", detail)
}

/// Code of the finding that a number is not known.
const PARAMETER_NOT_KNOWN: &str = "parameter_not_known";

/// The numbers of effects that are not known.
fn not_known(diagnosis: &Diagnosis) -> Vec<&str> {
    let findings = diagnosis.findings.iter().filter(|finding| finding.code == PARAMETER_NOT_KNOWN);
    findings.map(|finding| finding.subject.as_str()).collect()
}

/// The base's own numbers that have changed, a line each; of a short answer with many in a few lines, by their symbols.
fn changed_numbers(diagnosis: &Diagnosis, detail: Detail) -> String {
    let changed = &diagnosis.changed_parameters;
    let is_short = detail == Detail::Short && changed.len() > MOST_CHANGED_LINES;
    let each = changed.iter().map(|it| {
        let to = measured(it.to, it.standard_error, &it.unit);
        let name = if is_short { it.symbol.clone() } else { format!("{} ({}):", it.name, it.symbol) };
        format!("{name} {} -> {to}", number(it.from, 5))
    });
    if is_short {
        return wrapped("  ", &format!("its own numbers: {}", each.collect::<Vec<_>>().join(", ")));
    }
    each.map(|line| format!("  {line}\n")).collect()
}

/// The blocks in which the model fails. Of one alone it goes without saying that all of the error is in it.
fn places(diagnosis: &Diagnosis) -> String {
    let shown: Vec<_> = failing(diagnosis).collect();
    let line = |place: &&FailurePlace| {
        let FailurePlace { block, share_of_error, depends_on, explained } = place;
        let share =
            (shown.len() > 1).then(|| format!("{:.0} % of the error above noise", 100.0 * share_of_error));
        let follows = (*explained >= THRESHOLDS.shown_explained).then(|| {
            let what = if share.is_some() { "it" } else { "the error above noise" };
            format!("{depends_on} explains {:.0} % of {what}", 100.0 * explained)
        });
        let said: Vec<String> = share.into_iter().chain(follows).collect();
        if said.is_empty() { String::new() } else { wrapped("", &format!("{block}: {}", said.join("; "))) }
    };
    shown.iter().map(line).collect()
}

/// Where the model fails, as far as it is worth a word.
pub(super) fn failing(diagnosis: &Diagnosis) -> impl Iterator<Item = &FailurePlace> {
    let fails = diagnosis.verdict != Verdict::Adequate;
    diagnosis.r#where.iter().filter(move |place| fails && place.share_of_error > THRESHOLDS.shown_share)
}

/// An extension by `added`.
#[must_use]
pub fn extension(extension: &Extension, added: &[String]) -> String {
    let (model, error) = (&extension.model, &extension.error);
    let mut out = wrapped("", &verdict::extension(extension, added).1);
    let found = found_parameters(model);
    let changes = model.last_changes();
    let moved = moves_voltage_gain(changes.iter().map(|changed| &changed.name));
    for id in added {
        out += &card(id, (model, moved), found.iter().map(|(name, found)| (name, found)), &[]);
    }
    for changed in changes {
        let (unit, symbol) = Model::base_parameter_unit(&changed.name);
        let to = measured(changed.to, changed.standard_error, unit);
        let _ = writeln!(out, "  {} ({symbol}): {} -> {to}", changed.name, number(changed.from, 5));
    }
    out.push('\n');
    out += &errors(error);
    out.push_str("\nLadder, held-out error each time\n");
    for (number_of, step) in model.ladder.iter().enumerate() {
        let fall = &step.error;
        let sentence = format!(
            "{}: {} -> {} {}",
            step_title(step),
            number(fall.validate_before, 4),
            number(fall.validate_after, 4),
            fall.measure.unit
        );
        out += &wrapped(&format!("  {} ", number_of + 1), &sentence);
    }
    out
}

/// A model whose own numbers stay as they are.
#[must_use]
pub fn nothing_to_change(finding: &Finding, error: &ErrorSummary) -> String {
    let (held_out, floor) = (error.base.validate, error.noise_floor);
    let left = format!(
        "The held-out error is {} {}; noise alone leaves {}.",
        number(held_out, 3),
        error.unit,
        number(floor, 2)
    );
    wrapped("Nothing to change: ", &sentence(finding)) + &wrapped("", &left)
}

/// What a step of the ladder did.
#[must_use]
pub fn step_title(step: &ModelStep) -> String {
    if step.added.is_empty() {
        "its own numbers refitted".to_owned()
    } else {
        format!("+ {}", step.added.join(" + "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_that_the_table_has_no_room_for_are_counted() {
        let mut said = Diagnosis::of(Verdict::Unknown, &[]);
        said.error.channel = "rate [rad/s]".to_owned();
        let candidate = |number: usize| RankedCandidate {
            effect: format!("effect_{number}"),
            channel: "rate [rad/s]".to_owned(),
            train: Some(1.0),
            validate: Some(1.0 + number as f64),
            p_value: None,
            surrogate_error: None,
            drop_one: None,
            refusal: None,
            not_named: None,
        };
        said.candidates = (0..SHOWN_OF_NONE).map(candidate).collect();
        assert!(!candidates(&said, Detail::Short).contains("took off less"));
        said.candidates = (0..SHOWN_OF_NONE + 9).map(candidate).collect();
        let short = candidates(&said, Detail::Short);
        assert!(short.contains("9 more took off less (--notes lists them)"), "{short}");
        let every = candidates(&said, Detail::Every);
        assert!(every.contains("effect_14") && !every.contains("took off less"), "{every}");
        // One that is named stands beside them.
        said.effects = vec!["effect_4".to_owned()];
        let short = candidates(&said, Detail::Short);
        assert!(short.contains("effect_4") && short.contains("12 more"), "{short}");
    }

    #[test]
    fn many_changed_numbers_stand_in_a_few_lines_of_a_short_answer() {
        let few = Diagnosis::of(Verdict::ParametersChanged, &[]).with_changed("pole", 16.0, 12.0);
        let line = "  pole (p): 16.000 -> 12.000 rad/s\n";
        assert_eq!(changed_numbers(&few, Detail::Short), line);
        let mut many = few.clone();
        for name in ["voltage_gain", "steady_rate_linear", "steady_rate_quadratic"] {
            let said = Diagnosis::of(Verdict::ParametersChanged, &[]).with_changed(name, 40.0, 42.0);
            many.changed_parameters.extend(said.changed_parameters);
        }
        assert_eq!(changed_numbers(&many, Detail::Every).lines().count(), 4);
        let short = changed_numbers(&many, Detail::Short);
        assert!(short.starts_with("  its own numbers: p 16.000 -> 12.000 rad/s, "), "{short}");
        assert!(short.lines().count() < 4 && short.lines().all(|line| line.chars().count() <= 80), "{short}");
    }

    /// It stands behind the number, and then not among the notes of a short answer; never in neither place.
    #[test]
    fn a_number_that_is_not_known_is_said_beside_it_and_once() {
        let mut said = Diagnosis::of(Verdict::MissingEffect, &["transport_delay"]);
        let found =
            |value, unit: &str| FoundParameter { value, standard_error: Some(0.02), unit: unit.to_owned() };
        said.parameters.insert("transport_delay.delay".to_owned(), found(0.03, "s"));
        let text = |said: &Diagnosis, detail| {
            diagnosis(said, &[], detail).split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let (beside, note) =
            ("0.030000 ± 0.020 s, so how large is not known", "not how large this number is");
        assert!(!text(&said, Detail::Short).contains("how large"), "nothing says so");
        let finding = Finding::new(PARAMETER_NOT_KNOWN, "transport_delay.delay").with("value", 0.03);
        said.findings.push(finding.with("standard_error", 0.02));
        let short = text(&said, Detail::Short);
        assert!(short.contains(beside) && !short.contains(note), "{short}");
        let every = text(&said, Detail::Every);
        assert!(every.contains(beside) && every.contains(note), "{every}");
    }

    #[test]
    fn a_short_answer_says_reasons_where_there_is_one() {
        let said = |reasons: &[(&'static str, &str)], detail| {
            by_reason("Not tried: ", reasons.iter().map(|(effect, why)| (*effect, (*why).to_owned())), detail)
        };
        let one = [("a", "no battery"), ("b", "no battery")];
        let two = [("a", "no battery"), ("b", "no body")];
        assert_eq!(said(&one, Detail::Short), "Not tried: a, b (no battery)\n");
        assert_eq!(said(&two, Detail::Short), "Not tried: a, b (why: --notes)\n");
        assert_eq!(said(&two, Detail::Every), "Not tried: a (no battery)\nNot tried: b (no body)\n");
        assert_eq!(said(&[], Detail::Short), "");
    }

    #[test]
    fn numbers_carry_their_error_and_unit_and_a_bare_one_carries_none() {
        assert_eq!(measured(0.023_553_1, Some(2.97e-5), "N m"), "0.023553 ± 3.0e-5 N m");
        assert_eq!(measured(0.55, None, "-"), "0.55000");
    }
}
