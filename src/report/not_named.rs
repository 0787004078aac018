//! Why a candidate that was tried is not named, in words.

use super::number;
use crate::diagnose::Diagnosis;
use crate::diagnose::not_named::{NotNamed, Unmet};
use crate::unit::short;

/// The condition that a candidate failed: what stands in brackets behind its name.
#[must_use]
pub fn words(why: &NotNamed) -> String {
    let place = if why.beside.is_empty() { "alone" } else { "beside" };
    let place = [place, &why.beside.join(" + ")].join(" ").trim_end().to_owned();
    let of_fitted = "error of the data fitted on";
    match &why.condition {
        Unmet::NothingLeft => format!("{place} nothing but noise is left to explain"),
        Unmet::TooLittle { share, .. } if *share <= 0.0 => {
            format!("{place} the held-out error does not fall")
        }
        Unmet::TooLittle { share, needed } => too_little(&place, *share, *needed, "held-out squared error"),
        Unmet::TooLittleFitted { share, .. } if *share <= 0.0 => {
            format!("{place} the {of_fitted} does not fall")
        }
        Unmet::TooLittleFitted { share, needed } => {
            too_little(&place, *share, *needed, &format!("squared {of_fitted}"))
        }
        Unmet::Unsteady { standard_errors, needed } => format!(
            "{place} the error falls by {} of the fall's standard errors from stretch to stretch, {} are needed",
            number(*standard_errors, 2),
            short(*needed)
        ),
        Unmet::Chance { p_value, most } => {
            format!("{place} a p-value of {}, {} is the most", number(*p_value, 2), short(*most))
        }
        Unmet::NotExercised { needed } => {
            format!("{place} fewer than {needed} different commands lie beyond the limit")
        }
        Unmet::NotDetermined => format!("{place} a number is not told from that of no effect"),
        Unmet::Cancels => format!("{place} two effects cancel each other"),
        Unmet::Indistinguishable { set } => {
            format!("not told from the answer by these data: {}", set.join(" + "))
        }
        Unmet::LessThanAnother if why.beside.is_empty() => "another set takes more off the error".to_owned(),
        Unmet::LessThanAnother => format!("{} takes more off the error", why.beside.join(" + ")),
        Unmet::BodyDecides => "rotors and body together ask for another set".to_owned(),
    }
}

fn too_little(place: &str, share: f64, needed: f64, error: &str) -> String {
    format!("{place} {} % off the {error}, {} % are needed", number(100.0 * share, 2), short(100.0 * needed))
}

/// Each candidate that was tried and not named, in the order of the answer, with the condition that it failed.
pub fn all(diagnosis: &Diagnosis) -> impl Iterator<Item = (&str, String)> {
    let judged = diagnosis.candidates.iter();
    judged.filter_map(|it| Some((it.effect.as_str(), words(it.not_named.as_ref()?))))
}
