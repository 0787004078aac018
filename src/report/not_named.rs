//! Why a candidate that was tried is not named, in words.

use super::number;
use crate::diagnose::Diagnosis;
use crate::diagnose::not_named::{NotNamed, Unmet};
use crate::unit::short;

/// The condition that a candidate failed: what stands behind its name.
#[must_use]
pub fn words(why: &NotNamed) -> String {
    match &why.condition {
        Unmet::Indistinguishable { set } => {
            return format!("{} explains these data as well as what is named", set.join(" + "));
        }
        Unmet::LessThanAnother if why.beside.is_empty() => {
            return "another set lowers the error further".to_owned();
        }
        Unmet::LessThanAnother => return format!("{} lowers the error further", why.beside.join(" + ")),
        Unmet::BodyDecides => return "fitted to rotors and body together, another set is better".to_owned(),
        _ => {}
    }
    let place = if why.beside.is_empty() {
        "added alone".to_owned()
    } else {
        format!("added to {}", why.beside.join(" + "))
    };
    format!("{place}, {}", failed(&why.condition))
}

/// What came of adding it.
fn failed(condition: &Unmet) -> String {
    match condition {
        Unmet::NothingLeft => "it has nothing but noise to explain".to_owned(),
        Unmet::TooLittle { share, needed } => too_little(*share, *needed, "the held-out"),
        Unmet::TooLittleFitted { share, needed } => too_little(*share, *needed, "the fitted data's"),
        Unmet::Unsteady { standard_errors, needed } => format!(
            "it lowers the error in some parts of the data only: by {} standard errors, at least {} are needed",
            number(*standard_errors, 2),
            short(*needed)
        ),
        Unmet::Chance { p_value, most } => format!(
            "it does no better than a meaningless effect may by chance: p-value {}, at most {} is accepted",
            number(*p_value, 2),
            short(*most)
        ),
        Unmet::NotExercised { needed } => {
            format!("it has fewer than {needed} different commands beyond its limit")
        }
        Unmet::NotDetermined => "one of its numbers may as well be that of no effect".to_owned(),
        Unmet::Cancels => "it and another effect of the set cancel each other".to_owned(),
        // Said by `words`: they are not about adding it.
        Unmet::Indistinguishable { .. } | Unmet::LessThanAnother | Unmet::BodyDecides => {
            "another set is better".to_owned()
        }
    }
}

fn too_little(share: f64, needed: f64, whose: &str) -> String {
    if share <= 0.0 {
        return format!("it does not lower {whose} error");
    }
    let percent = number(100.0 * share, 2);
    format!("it takes {percent} % off {whose} squared error, at least {} % are needed", short(100.0 * needed))
}

/// Each candidate that was tried and not named, in the order of the answer, with the condition that it failed.
pub fn all(diagnosis: &Diagnosis) -> impl Iterator<Item = (&str, String)> {
    let judged = diagnosis.candidates.iter();
    judged.filter_map(|it| Some((it.effect.as_str(), words(it.not_named.as_ref()?))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_condition_has_a_sentence_that_says_what_was_needed() {
        let alone = |condition| words(&NotNamed { beside: vec![], condition });
        let beside = |condition| words(&NotNamed { beside: vec!["a".to_owned(), "b".to_owned()], condition });
        let set = vec!["c".to_owned(), "d".to_owned()];
        for (said, expected) in [
            (alone(Unmet::NothingLeft), "added alone, it has nothing but noise to explain"),
            (
                beside(Unmet::TooLittle { share: 0.0123, needed: 0.03 }),
                "added to a + b, it takes 1.2 % off the held-out squared error, at least 3 % are needed",
            ),
            (
                beside(Unmet::TooLittle { share: 0.0, needed: 0.03 }),
                "added to a + b, it does not lower the held-out error",
            ),
            (
                alone(Unmet::TooLittleFitted { share: 0.004, needed: 0.01 }),
                "added alone, it takes 0.40 % off the fitted data's squared error, at least 1 % are needed",
            ),
            (
                alone(Unmet::TooLittleFitted { share: -0.1, needed: 0.01 }),
                "added alone, it does not lower the fitted data's error",
            ),
            (
                alone(Unmet::Unsteady { standard_errors: 1.26, needed: 2.0 }),
                "added alone, it lowers the error in some parts of the data only: by 1.3 standard errors, at least 2 are needed",
            ),
            (
                alone(Unmet::Chance { p_value: 0.2, most: 0.05 }),
                "added alone, it does no better than a meaningless effect may by chance: p-value 0.20, at most 0.05 is accepted",
            ),
            (
                alone(Unmet::NotExercised { needed: 3 }),
                "added alone, it has fewer than 3 different commands beyond its limit",
            ),
            (
                beside(Unmet::NotDetermined),
                "added to a + b, one of its numbers may as well be that of no effect",
            ),
            (beside(Unmet::Cancels), "added to a + b, it and another effect of the set cancel each other"),
            (beside(Unmet::Indistinguishable { set }), "c + d explains these data as well as what is named"),
            (alone(Unmet::LessThanAnother), "another set lowers the error further"),
            (beside(Unmet::LessThanAnother), "a + b lowers the error further"),
            (alone(Unmet::BodyDecides), "fitted to rotors and body together, another set is better"),
        ] {
            assert_eq!(said, expected);
        }
    }
}
