//! The memory that all first-order lags of the catalogue share.

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
        fn advance(parameters: &[f64], state: f64, point: &$crate::effect::Point, span: f64) -> f64 {
            let [pole] = *parameters else { return point.$quantity };
            state + (point.$quantity - state) * $crate::effect::step_response(pole, span)
        }
        fn add(_: &[f64], state: f64, point: &$crate::effect::Point) -> f64 {
            state - point.$quantity
        }
        fn rate(parameters: &[f64]) -> f64 {
            parameters.first().copied().filter(|pole| pole.is_finite()).unwrap_or(0.0)
        }
        $crate::effect::Memory { steady_state, advance, add, rate, slow: $slow }
    }};
}
