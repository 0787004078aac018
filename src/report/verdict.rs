//! The verdict of `diagnose` in a sentence.

use std::path::Path;

use super::findings::{sentence as sentence_of, text as text_of};
use super::{Mark, number};
use crate::diagnose::diagnosis::{ErrorSummary, FoundParameter};
use crate::diagnose::{Diagnosis, Extension, Verdict};
use crate::model::Model;
use crate::report::found_parameters::found_parameters;
use crate::screening::Finding;
use crate::screening::checks::rate_behind_thrust::RATE_BEHIND_THRUST;

/// Codes of findings that say whose model it is: another bench's.
const OF_OTHER_BENCH: [&str; 2] = ["model_of_other_bench", "battery_of_other_bench"];
/// The code of a finding that stands right under the answer: what was judged on.
pub(super) const ONE_DIRECTION: &str = "one_direction_only";
/// Codes of findings that stand there, too: whether a delay is the rotor's, and a shift of the curve one.
const WHAT_IT_IS: [&str; 3] = [RATE_BEHIND_THRUST, "delay_or_late_reading", "shift_is_curve"];

/// Whether the model is another bench's, so that what is missing in it is no effect.
#[must_use]
pub fn is_of_other_bench(diagnosis: &Diagnosis) -> bool {
    let of_other = |finding: &Finding| OF_OTHER_BENCH.contains(&finding.code);
    diagnosis.verdict != Verdict::Adequate && diagnosis.findings.iter().any(of_other)
}

/// What stands before any answer about another bench's model; nothing else.
pub(super) fn other_bench(diagnosis: &Diagnosis) -> &'static str {
    if is_of_other_bench(diagnosis) {
        "This is not this bench's model: run `rotorbench identify` first, where that can make one. What follows says more of the model than of the bench. "
    } else {
        ""
    }
}

/// The answer in a sentence; names of effects between `mark`s.
#[must_use]
pub fn sentence(diagnosis: &Diagnosis, mark: &str) -> String {
    let effects = joined(diagnosis.effects.iter(), mark);
    let is_judged_on_fitted = is_judged_on_fitted(diagnosis);
    let error = if is_judged_on_fitted { "error" } else { "held-out error" };
    let answer = match diagnosis.verdict {
        Verdict::MissingEffect => format!("The model is missing: {}.", missing(diagnosis, mark)),
        Verdict::Adequate => nothing_missing(&diagnosis.model, mark) + &not_looked_at(diagnosis),
        Verdict::ParametersChanged => {
            let changed = "None of the effects tried is missing; the model's own numbers have changed.";
            changed.to_owned() + &not_looked_at(diagnosis)
        }
        Verdict::Unknown if effects.is_empty() => {
            "Something is missing, and nothing that was tried explains it.".to_owned()
        }
        Verdict::Unknown => {
            format!("Something is missing. {}", explained_part(&effects, &diagnosis.error, error))
        }
        Verdict::InsufficientData => "These data cannot tell.".to_owned(),
    };
    let answer =
        if is_judged_on_fitted { format!("Judged on a log that was fitted, too. {answer}") } else { answer };
    other_bench(diagnosis).to_owned() + &answer
}

/// Names of effects, each between `mark`s.
fn joined<'a>(effects: impl Iterator<Item = &'a String>, mark: &str) -> String {
    effects.map(|id| format!("{mark}{id}{mark}")).collect::<Vec<_>>().join(" + ")
}

/// What is missing: where other sets do as well, first what all of them have, for that is all that is sure.
pub(super) fn missing(diagnosis: &Diagnosis, mark: &str) -> String {
    if diagnosis.alternatives.is_empty() && diagnosis.further_alternatives.is_empty() {
        return joined(diagnosis.effects.iter(), mark);
    }
    let is_sure = |id: &&String| diagnosis.common_effects.contains(*id);
    let sure = joined(diagnosis.effects.iter().filter(is_sure), mark);
    let open = joined(diagnosis.effects.iter().filter(|id| !is_sure(id)), mark);
    let others = diagnosis.alternatives.iter().chain(&diagnosis.further_alternatives);
    let sizes: Vec<usize> = others.map(Vec::len).collect();
    let sure_alone = sizes.iter().filter(|size| **size == diagnosis.common_effects.len()).count();
    let as_well = if sure_alone < sizes.len() { " or something else that does as well" } else { "" };
    let them = if diagnosis.common_effects.len() > 1 { "them" } else { "it" };
    match (sure.is_empty(), open.is_empty()) {
        (true, _) => format!("{open},{as_well}"),
        (_, true) => format!("{sure}, alone or with something else"),
        _ if sure_alone > 0 => format!("{sure}, and perhaps {open}{as_well} beside {them}"),
        _ => format!("{sure}, and beside {them} {open}{as_well}"),
    }
}

/// The finding of a log that is fitted on and given as held out.
const FITTED_AND_VALIDATED: &str = "log_fitted_and_validated";

/// Whether what is called held out was fitted, at least a log of it.
fn is_judged_on_fitted(diagnosis: &Diagnosis) -> bool {
    let finds = diagnosis.findings.iter().any(|finding| finding.code == FITTED_AND_VALIDATED);
    finds && diagnosis.verdict != Verdict::InsufficientData
}

/// Nothing is missing, or nothing more than the effects that the model has, with their numbers.
fn nothing_missing(model: &Model, mark: &str) -> String {
    let number = |(name, found): &(String, FoundParameter)| match found.unit.as_str() {
        "s" if found.value.abs() < 1.0 => (name.clone(), format!("{} ms", number(1e3 * found.value, 4))),
        "-" | "" => (name.clone(), number(found.value, 4)),
        unit => (name.clone(), format!("{} {unit}", number(found.value, 4))),
    };
    let found = found_parameters(model);
    let effect = |id: &String| {
        let own = found.iter().filter(|(name, _)| name.split_once('.').is_some_and(|(of, _)| of == id));
        let numbers: Vec<(String, String)> = own.map(number).collect();
        let said = match &numbers[..] {
            [] => String::new(),
            [(_, only)] => format!(" ({only})"),
            several => {
                let bare = |name: &str| name.split_once('.').map_or("", |(_, bare)| bare).to_owned();
                let each = several.iter().map(|(name, value)| format!("{} {value}", bare(name)));
                format!(" ({})", each.collect::<Vec<_>>().join(", "))
            }
        };
        format!("{mark}{id}{mark}{said}")
    };
    let effects: Vec<String> = model.effects.iter().map(|added| effect(&added.id)).collect();
    if effects.is_empty() {
        return "Nothing is missing that these data could show.".to_owned();
    }
    format!(
        "Nothing more is missing that these data could show: the model already has {}.",
        effects.join(" and ")
    )
}

/// That little of what a command does was looked at, and in which log, where that is so.
fn not_looked_at(diagnosis: &Diagnosis) -> String {
    let left_out = diagnosis.findings.iter().filter(|finding| finding.code == "moves_left_out");
    let mut logs: Vec<&str> = left_out.map(|finding| finding.log.as_str()).collect();
    logs.dedup();
    let Some((first, others)) = logs.split_first() else { return String::new() };
    let others = if others.is_empty() { "" } else { " and others" };
    let name = Path::new(first).file_name().and_then(|name| name.to_str()).unwrap_or(first);
    format!(
        " Most of what a command does in {name}{others} is in rows that are left out, and was not looked at."
    )
}

/// How far the error, which is called `what`, falls with what explains a part.
fn explained_part(effects: &str, error: &ErrorSummary, what: &str) -> String {
    let (before, after) = (error.without_effects(), error.extended.validate);
    let (floor, unit) = (number(error.noise_floor, 2), error.unit);
    let left = number(after / error.noise_floor, 3);
    if after >= before {
        let article = if what.starts_with('e') { "an" } else { "a" };
        return format!(
            "{effects} comes nearest, with {article} {what} of {} {unit}; noise is {floor}, so {left} times the noise is left. \
             Nothing that was tried explains it.",
            number(after, 3)
        );
    }
    let refitted = if before < error.base.validate { " (its own numbers refitted)" } else { "" };
    format!(
        "With {effects} the {what} falls from {}{refitted} to {} {unit}; noise is {floor}, so {left} times the noise is \
         left ({:.0} % of the squared error above it is explained). Nothing that was tried explains the rest.",
        number(before, 3),
        number(after, 3),
        100.0 * error.explained()
    )
}

/// What stands right under the answer, names of effects between `mark`s: what it was judged on, and what else it may be.
#[must_use]
pub fn beneath(diagnosis: &Diagnosis, mark: &str) -> Vec<String> {
    let judged = diagnosis.findings.iter().filter(|finding| finding.code == ONE_DIRECTION);
    let judged = judged.map(|finding| capitalised(&text_of(finding)) + ".");
    let whose_delay = what_it_is(diagnosis).map(|finding| sentence_of(finding) + ".");
    let errors = diagnosis.alternative_errors.iter();
    let others = diagnosis.alternatives.iter().zip(errors).map(|(other, (error, unit))| {
        let other = other.join(" + ");
        format!("These data cannot tell it from {mark}{other}{mark} (held out {} {unit}).", number(*error, 3))
    });
    let not_held_out = diagnosis.findings.iter().filter(|finding| finding.code == FITTED_AND_VALIDATED);
    let not_held_out = not_held_out.map(|finding| {
        format!("Not held out: {mark}{}{mark} was fitted, too: {}.", finding.log, text_of(finding))
    });
    let further: Vec<String> =
        diagnosis.further_alternatives.iter().map(|set| format!("{mark}{}{mark}", set.join(" + "))).collect();
    let further = (!further.is_empty()).then(|| format!("Nor from {}.", further.join(", or ")));
    not_held_out
        .chain(judged)
        .chain(whose_delay)
        .chain(others)
        .chain(further)
        .chain(common(diagnosis, mark).filter(|_| !says_common(diagnosis)))
        .collect()
}

/// What all the sets have that the data cannot tell apart, names of effects between `mark`s; `None` where there is one set, or nothing.
#[must_use]
pub fn common(diagnosis: &Diagnosis, mark: &str) -> Option<String> {
    let ids: Vec<String> = diagnosis.common_effects.iter().map(|id| format!("{mark}{id}{mark}")).collect();
    let (last, before) = ids.split_last().filter(|_| !diagnosis.alternatives.is_empty())?;
    let before = if before.is_empty() { String::new() } else { format!("{} and ", before.join(", ")) };
    Some(format!("All of these sets, the named one among them, have {before}{last}."))
}

/// Whether the answer in a sentence says what all sets have.
#[must_use]
pub fn says_common(diagnosis: &Diagnosis) -> bool {
    diagnosis.verdict == Verdict::MissingEffect
}

/// What a named effect is said to be, as the first log says that says it.
fn what_it_is(diagnosis: &Diagnosis) -> impl Iterator<Item = &Finding> {
    WHAT_IT_IS.into_iter().filter_map(|code| diagnosis.findings.iter().find(|it| it.code == code))
}

fn capitalised(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Findings that are not said at the top already.
pub(super) fn notes(diagnosis: &Diagnosis) -> impl Iterator<Item = &Finding> {
    let at_the_top = [ONE_DIRECTION, FITTED_AND_VALIDATED];
    // How far above its noise the error stays is in the answer that names a part, for the channel that it speaks of.
    let is_partial = diagnosis.verdict == Verdict::Unknown && !diagnosis.effects.is_empty();
    let is_said = move |finding: &Finding| {
        if what_it_is(diagnosis).any(|said| std::ptr::eq(said, finding)) {
            return true;
        }
        let rest = diagnosis.error.channel.strip_prefix(finding.subject.as_str());
        finding.code == "error_above_floor" && is_partial && rest.is_some_and(|rest| rest.starts_with(" ["))
    };
    diagnosis.findings.iter().filter(move |finding| !at_the_top.contains(&finding.code) && !is_said(finding))
}

/// What the standard errors of an answer rest on, where they do.
#[must_use]
pub fn reservation(diagnosis: &Diagnosis) -> Option<&'static str> {
    let is_partial = diagnosis.verdict == Verdict::Unknown
        && !(diagnosis.effects.is_empty() && diagnosis.changed_parameters.is_empty());
    is_partial.then_some("Each ± holds only if nothing else is missing, and something is.")
}

/// What an extension by `added` did to the error.
#[must_use]
pub fn extension(extension: &Extension, added: &[String]) -> (Mark, String) {
    let error = &extension.error;
    let unit = error.unit;
    let (falls, what) = if added.is_empty() {
        (error.extended.validate < error.base.validate, "Refitting the model's own numbers".to_owned())
    } else {
        (error.extended.validate < error.without_effects(), format!("Adding {}", added.join(" + ")))
    };
    let mark = match (falls, extension.is_at_floor) {
        (true, true) => Mark::Good,
        (true, false) | (false, true) => Mark::Warning,
        (false, false) => Mark::Bad,
    };
    let refitted = if !added.is_empty() && error.refitted.validate < error.base.validate {
        format!(" ({} with its own numbers refitted)", number(error.refitted.validate, 3))
    } else {
        String::new()
    };
    let left = if extension.is_at_floor {
        String::new()
    } else {
        format!(", so {} times the noise is left", number(error.extended.validate / error.noise_floor, 3))
    };
    let sentence = format!(
        "{what} takes the held-out error from {}{refitted} to {} {unit}; noise alone leaves {} {unit}{left}.",
        number(error.base.validate, 3),
        number(error.extended.validate, 3),
        number(error.noise_floor, 2)
    );
    (mark, sentence)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_explains_a_part_is_said_in_numbers_of_the_better_baseline() {
        let said = |base, refitted, extended| {
            explained_part("an effect", &ErrorSummary::of_rotor([base, refitted, extended]), "held-out error")
        };
        let worse = said(17.7, 39.3, 9.626);
        assert!(worse.contains("from 17.7 to 9.63 rad/s") && worse.contains("11.6 times"), "{worse}");
        assert!(said(813.0, 37.2, 23.0).contains("from 37.2 (its own"), "{}", said(813.0, 37.2, 23.0));
        assert!(said(17.7, 39.3, 20.0).contains("comes nearest"), "nothing is explained");
    }

    #[test]
    fn what_was_fitted_is_not_held_out() {
        let mut said = Diagnosis::of(Verdict::Unknown, &["battery_sag"]);
        assert!(sentence(&said, "").contains("held-out error"));
        said.findings.push(Finding::new("log_fitted_and_validated", "").of("a.csv"));
        let headline = sentence(&said, "");
        assert!(headline.starts_with("Judged on a log that was fitted, too. Something"), "{headline}");
        assert!(!headline.contains("held-out"), "{headline}");
        let lines = beneath(&said, "`");
        assert!(lines[0].starts_with("Not held out: `a.csv` was fitted, too: "), "{lines:?}");
        assert_eq!(notes(&said).count(), 0, "it is said once");
    }

    #[test]
    fn nothing_more_is_missing_beside_what_the_model_has() {
        let mut said = Diagnosis::of(Verdict::Adequate, &[]);
        assert_eq!(sentence(&said, ""), "Nothing is missing that these data could show.");
        for id in ["transport_delay", "gravity_pendulum"] {
            said.model = said.model.with(&said.model.effect(id).expect("known"));
        }
        said.model.set_parameter("transport_delay.delay", 0.034_98);
        said.model.set_parameter("gravity_pendulum.moment", 0.4);
        let headline = sentence(&said, "`");
        let begin = "Nothing more is missing that these data could show: the model already has `transport_delay` (34.98 ms) and `gravity_pendulum` (";
        assert!(headline.starts_with(begin) && headline.contains("moment 0.4000 N m"), "{headline}");
    }

    #[test]
    fn nothing_is_missing_in_what_was_looked_at() {
        let mut said = Diagnosis::of(Verdict::Adequate, &[]);
        said.findings.extend([1, 2].map(|_| about("moves_left_out").of("logs/wheel.csv")));
        let headline = sentence(&said, "");
        let end =
            " Most of what a command does in wheel.csv is in rows that are left out, and was not looked at.";
        assert!(headline.ends_with(&("could show.".to_owned() + end)), "{headline}");
        said.findings.push(about("moves_left_out").of("second.csv"));
        assert!(sentence(&said, "").contains("in wheel.csv and others is"), "{}", sentence(&said, ""));
        said.verdict = Verdict::ParametersChanged;
        assert!(sentence(&said, "").contains("and others is"), "{}", sentence(&said, ""));
    }

    fn about(code: &'static str) -> Finding {
        Finding::new(code, "actuator_1")
    }

    #[test]
    fn another_benches_model_is_said_before_the_answer_unless_nothing_is_missing() {
        let mut said = Diagnosis::of(Verdict::Unknown, &["battery_sag"]);
        said.findings.push(about("model_of_other_bench"));
        assert!(sentence(&said, "").starts_with("This is not this bench's model"), "{}", sentence(&said, ""));
        said.verdict = Verdict::Adequate;
        assert!(!sentence(&said, "").contains("not this bench's"), "{}", sentence(&said, ""));
    }

    #[test]
    fn what_the_data_cannot_tell_apart_stands_right_under_the_answer() {
        let mut said = Diagnosis::of(Verdict::MissingEffect, &["actuator_mismatch"]);
        assert!(beneath(&said, "").is_empty());
        said.alternatives.push(vec!["torque_bias".to_owned(), "body_drag".to_owned()]);
        said.common_effects.clear();
        said.alternative_errors.push((0.0123, "rad"));
        let lines = beneath(&said, "`");
        assert_eq!(
            lines,
            ["These data cannot tell it from `torque_bias + body_drag` (held out 0.0123 rad)."],
            "{lines:?}"
        );
        said.further_alternatives = vec![vec!["ground_effect".to_owned()], vec!["gyro_bias".to_owned()]];
        assert_eq!(beneath(&said, "")[1..], ["Nor from ground_effect, or gyro_bias."]);
        said.common_effects = vec!["gyro_lag".to_owned(), "cable_stiffness".to_owned()];
        assert_eq!(beneath(&said, "`").len(), 2, "the headline says it");
        said.verdict = Verdict::Unknown;
        assert_eq!(
            beneath(&said, "`")[2..],
            ["All of these sets, the named one among them, have `gyro_lag` and `cable_stiffness`."]
        );
        said.alternatives.clear();
        said.further_alternatives.clear();
        assert!(beneath(&said, "").is_empty(), "there is one set");
    }

    #[test]
    fn what_all_sets_have_comes_first_and_what_does_as_well_is_no_more_than_that() {
        let mut said = Diagnosis::of(Verdict::MissingEffect, &["gyro_bias", "gyro_lag", "cable_stiffness"]);
        let set = |ids: &[&str]| ids.iter().map(|id| (*id).to_owned()).collect::<Vec<_>>();
        let headline = |said: &Diagnosis| sentence(said, "`");
        assert_eq!(
            headline(&said),
            "The model is missing: `gyro_bias` + `gyro_lag` + `cable_stiffness`.",
            "one set"
        );
        said.alternatives.push(set(&["gyro_lag", "cable_stiffness", "gyro_scale"]));
        said.common_effects = set(&["gyro_lag", "cable_stiffness"]);
        let begin = "The model is missing: `gyro_lag` + `cable_stiffness`, and";
        assert_eq!(
            headline(&said),
            format!("{begin} beside them `gyro_bias` or something else that does as well.")
        );
        said.further_alternatives.push(set(&["gyro_lag", "cable_stiffness"]));
        assert_eq!(
            headline(&said),
            format!("{begin} perhaps `gyro_bias` or something else that does as well beside them.")
        );
        said.alternatives.clear();
        assert_eq!(headline(&said), format!("{begin} perhaps `gyro_bias` beside them."));
        said.alternatives.push(set(&["gyro_lag", "torque_bias"]));
        said.common_effects = set(&["gyro_lag"]);
        assert_eq!(
            headline(&said),
            "The model is missing: `gyro_lag`, and beside it `gyro_bias` + `cable_stiffness` or something else that does as well."
        );
        said.common_effects.clear();
        assert_eq!(
            headline(&said),
            "The model is missing: `gyro_bias` + `gyro_lag` + `cable_stiffness`, or something else that does as well."
        );
        said.effects = set(&["gyro_lag"]);
        said.common_effects = set(&["gyro_lag"]);
        assert_eq!(headline(&said), "The model is missing: `gyro_lag`, alone or with something else.");
    }

    #[test]
    fn errors_hold_only_where_nothing_else_is_missing() {
        let named = |verdict| reservation(&Diagnosis::of(verdict, &["battery_sag"])).is_some();
        assert!(named(Verdict::Unknown) && !named(Verdict::MissingEffect));
        assert!(reservation(&Diagnosis::of(Verdict::Unknown, &[])).is_none(), "there is no number");
        let changed = Diagnosis::of(Verdict::Unknown, &[]).with_changed("inertia", 0.1, 0.2);
        assert!(reservation(&changed).is_some());
    }
}
