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
        let power = match at {
            0 => "u".to_owned(),
            at => format!("u^{}", at + 1),
        };
        format!("{} {power}", short(*value))
    };
    coefficients.iter().enumerate().map(term).collect::<Vec<String>>().join(" + ").replace("+ -", "- ")
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
