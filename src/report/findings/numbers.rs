//! Numbers as sentences show them.

use crate::screening::Finding;
use crate::unit::{short, with_error};

/// Three digits of a number that is not known to two, and of its error.
pub(super) fn in_digits(finding: &Finding, value: &str, error: &str) -> String {
    let digits = |value: f64| short(format!("{value:.2e}").parse().unwrap_or(value));
    format!("{} ± {}", digits(finding.number(value)), digits(finding.number(error)))
}

/// Σ c_j u^j from j = 1.
pub(super) fn formula(coefficients: &[f64]) -> String {
    let term = |(at, value): (usize, &f64)| {
        let number = short(*value);
        match (at, number.strip_prefix('-')) {
            (0, _) => format!("{number} u"),
            (at, Some(taken_away)) => format!(" - {taken_away} u^{}", at + 1),
            (at, None) => format!(" + {number} u^{}", at + 1),
        }
    };
    coefficients.iter().enumerate().map(term).collect()
}

/// A value with its error; without one where it is exact.
pub(super) fn value_of([value, error]: [f64; 2]) -> String {
    if error == 0.0 { short(value) } else { with_error(value, error) }
}

/// So many things of a kind.
pub(super) fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// A number for people: so many digits of it.
pub(super) fn digits(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scale = 10f64.powi(digits - 1 - value.abs().log10().floor() as i32);
    short((value * scale).round() / scale)
}

/// Why rates come too seldom: what steps of the log show, or what a model says.
pub(super) fn settled_between(finding: &Finding) -> String {
    let pole = digits(finding.number("pole_rad_s"), 3);
    match finding.count("steps") {
        0 => format!(
            "and a rotor with a pole of {pole} rad/s, the model's, has settled between two of them (no step here shows this rotor's)"
        ),
        steps => format!(
            "and behind {} of this log the rotor has settled before too few of them to say how (the model's pole is {pole} rad/s)",
            counted(steps, "step")
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_has_the_signs_of_its_terms_between_them() {
        assert_eq!(formula(&[-2.0, 3.5, -0.5]), "-2 u + 3.5 u^2 - 0.5 u^3");
        assert_eq!(formula(&[]), "");
    }
}
