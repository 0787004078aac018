//! What all dead times of the catalogue share.

use super::Parameter;

/// The delay [s] that is their one parameter, with the starts of a fit behind the first.
pub(super) const fn parameter(symbol: &'static str, others: &'static [f64]) -> Parameter {
    Parameter {
        name: "delay",
        symbol,
        unit: "s",
        lower: 0.0,
        upper: 0.3,
        start: 0.01,
        others,
        neutral: 0.0,
        meaning: "how late",
    }
}

/// [s] by what they hold back.
pub(super) fn of(parameters: &[f64]) -> f64 {
    parameters.first().copied().unwrap_or(0.0)
}
