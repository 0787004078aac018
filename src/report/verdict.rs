//! The verdict of `diagnose` in a sentence.

use super::findings::text as text_of;
use super::{Mark, number};
use crate::diagnose::diagnosis::ErrorSummary;
use crate::diagnose::{Diagnosis, Extension, Verdict};
use crate::screening::Finding;

/// Codes of findings that say whose model it is: another bench's.
const OF_OTHER_BENCH: [&str; 2] = ["model_of_other_bench", "battery_of_other_bench"];
/// The code of the finding that stands right under the answer.
pub(super) const ONE_DIRECTION: &str = "one_direction_only";

/// Whether the model is another bench's, so that what is missing in it is no effect.
#[must_use]
pub fn is_of_other_bench(diagnosis: &Diagnosis) -> bool {
    let of_other = |finding: &Finding| OF_OTHER_BENCH.contains(&finding.code);
    diagnosis.verdict != Verdict::Adequate && diagnosis.findings.iter().any(of_other)
}

/// What stands before any answer about another bench's model; nothing else.
pub(super) fn other_bench(diagnosis: &Diagnosis) -> &'static str {
    if is_of_other_bench(diagnosis) {
        "This is not this bench's model: run `rotorbench identify` first. What follows says more of the model than of the bench. "
    } else {
        ""
    }
}

/// The answer in a sentence; names of effects between `mark`s.
#[must_use]
pub fn sentence(diagnosis: &Diagnosis, mark: &str) -> String {
    let effects: Vec<String> = diagnosis.effects.iter().map(|id| format!("{mark}{id}{mark}")).collect();
    let effects = effects.join(" + ");
    let answer = match diagnosis.verdict {
        Verdict::MissingEffect => format!("The model is missing: {effects}."),
        Verdict::Adequate => "Nothing is missing that these data could show.".to_owned(),
        Verdict::ParametersChanged => {
            "None of the effects tried is missing; the model's own numbers have changed.".to_owned()
        }
        Verdict::Unknown if effects.is_empty() => {
            "Something is missing, and nothing that was tried explains it.".to_owned()
        }
        Verdict::Unknown => format!("Something is missing. {}", explained_part(&effects, &diagnosis.error)),
        Verdict::InsufficientData => "These data cannot tell.".to_owned(),
    };
    other_bench(diagnosis).to_owned() + &answer
}

/// How far the error falls with what explains a part.
fn explained_part(effects: &str, error: &ErrorSummary) -> String {
    let (before, after) = (error.without_effects(), error.extended.validate);
    let (floor, unit) = (number(error.noise_floor, 2), error.unit);
    let left = number(after / error.noise_floor, 3);
    if after >= before {
        return format!(
            "{effects} comes nearest, with a held-out error of {} {unit}; noise is {floor}, so {left} times the noise is left. \
             Nothing that was tried explains it.",
            number(after, 3)
        );
    }
    let refitted = if before < error.base.validate { " (its own numbers refitted)" } else { "" };
    format!(
        "With {effects} the held-out error falls from {}{refitted} to {} {unit}; noise is {floor}, so {left} times the noise is \
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
    let errors = diagnosis.alternative_errors.iter();
    let others = diagnosis.alternatives.iter().zip(errors).map(|(other, (error, unit))| {
        let other = other.join(" + ");
        format!("These data cannot tell it from {mark}{other}{mark} (held out {} {unit}).", number(*error, 3))
    });
    judged.chain(others).collect()
}

fn capitalised(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Findings that are not said at the top already.
pub(super) fn notes(diagnosis: &Diagnosis) -> impl Iterator<Item = &Finding> {
    diagnosis.findings.iter().filter(|finding| finding.code != ONE_DIRECTION)
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
            explained_part("an effect", &ErrorSummary::of_rotor([base, refitted, extended]))
        };
        let worse = said(17.7, 39.3, 9.626);
        assert!(worse.contains("from 17.7 to 9.63 rad/s") && worse.contains("11.6 times"), "{worse}");
        assert!(said(813.0, 37.2, 23.0).contains("from 37.2 (its own"), "{}", said(813.0, 37.2, 23.0));
        assert!(said(17.7, 39.3, 20.0).contains("comes nearest"), "nothing is explained");
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
        said.alternative_errors.push((0.0123, "rad"));
        let lines = beneath(&said, "`");
        assert_eq!(
            lines,
            ["These data cannot tell it from `torque_bias + body_drag` (held out 0.0123 rad)."],
            "{lines:?}"
        );
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
