//! What the logs hardly show is not put into the model: the template's number is kept, and it is said.

use super::{Body, Estimate};
use crate::unit::short;

/// Standard error, as a share of a number, beyond which there is none.
const UNSURE: f64 = 0.4;
/// Standard errors between what logs hardly show and the template's number from which they speak against it.
const AGAINST: f64 = 4.0;

/// Whether a number that was fitted is one.
pub(crate) fn is_sure(estimate: &Estimate) -> bool {
    estimate.standard_error <= UNSURE * estimate.value.abs()
}

/// Three digits of a number that is not known to two, and of its error.
pub(crate) fn in_digits(estimate: &Estimate) -> String {
    let digits = |value: f64| short(format!("{value:.2e}").parse().unwrap_or(value));
    format!("{} ± {}", digits(estimate.value), digits(estimate.standard_error))
}

/// Why a pole that was fitted is none.
pub(crate) fn no_pole(pole: &Estimate) -> Option<String> {
    (!is_sure(pole)).then(|| {
        format!(
            "the pole would be {:.2} ± {:.2} rad/s, which is none: the rates do not follow these commands (another rotor's \
             column, samples too far apart, commands that changed between the rows)",
            pole.value, pole.standard_error
        )
    })
}

/// Why a k_V that was fitted is none. A battery that gives way never makes a rotor faster.
pub(crate) fn no_gain(gain: &Estimate) -> Option<String> {
    (!is_sure(gain) || gain.value < 0.0).then(|| {
        format!("k_V would be {} rad/(s V), which hardly shows: hold commands longer", in_digits(gain))
    })
}

/// Whether a k_V that hardly shows is plainly not the template's: it is next to nothing, then, and known to be.
pub(crate) fn is_none(gain: &Estimate, template: f64) -> bool {
    !is_sure(gain) && gain.distance(template) > AGAINST
}

/// What of a k_V that hardly shows is to be said beside the template's, which is kept.
pub(crate) fn shown_of_gain(gain: Option<&Estimate>) -> String {
    gain.map_or("nothing in the logs shows it".to_owned(), |gain| {
        format!("what the logs show, {} rad/(s V), is not known well enough", in_digits(gain))
    })
}

/// Why a J that was fitted is none.
pub(crate) fn no_inertia(body: &Body) -> Option<String> {
    (!is_sure(&body.inertia)).then(|| {
        format!(
            "J would be {} kg m², which hardly shows: excite the attitude more, or longer; the template's J is kept",
            in_digits(&body.inertia)
        )
    })
}
