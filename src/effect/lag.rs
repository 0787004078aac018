//! What all first-order lags of the catalogue share: their memory, and the pole that is their one parameter.

use super::Parameter;

/// The pole of a lag [rad/s], from `lower` on, with the first start of a fit and the others.
pub(super) const fn pole(
    symbol: &'static str,
    lower: f64,
    (start, others): (f64, &'static [f64]),
    meaning: &'static str,
) -> Parameter {
    let neutral = f64::INFINITY;
    Parameter { name: "pole", symbol, unit: "rad/s", lower, upper: 2e3, start, others, neutral, meaning }
}

/// The [`Memory`] of a first-order lag: what passes on is one of a [`Point`]'s quantities, behind the pole [rad/s] that is
/// the effect's one parameter.
///
/// [`Memory`]: super::Memory
/// [`Point`]: super::Point
macro_rules! lag {
    ($quantity:ident, slow: $slow:literal) => {{
        fn steady_state(_: &[f64], point: &$crate::effect::Point) -> f64 {
            point.$quantity
        }
        fn transition(parameters: &[f64], span: f64) -> f64 {
            parameters.first().map_or(1.0, |pole| $crate::effect::step_response(*pole, span))
        }
        fn advance(_: &[f64], state: f64, point: &$crate::effect::Point, share: f64) -> f64 {
            state + (point.$quantity - state) * share
        }
        fn add(_: &[f64], state: f64, point: &$crate::effect::Point) -> f64 {
            state - point.$quantity
        }
        fn rate(parameters: &[f64]) -> f64 {
            parameters.first().copied().filter(|pole| pole.is_finite()).unwrap_or(0.0)
        }
        $crate::effect::Memory { steady_state, transition, advance, add, rate, corner: None, slow: $slow }
    }};
}
