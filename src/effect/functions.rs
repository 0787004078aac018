//! Functions that a fit asks for a hundred million times.

/// Step response of a first-order lag: the share of the step that is done `span` seconds after it, at a pole of `rate` [rad/s].
#[must_use]
pub fn step_response(rate: f64, span: f64) -> f64 {
    response_after(rate * span)
}

/// The same after so many time constants.
#[must_use]
pub(super) fn response_after(whole: f64) -> f64 {
    // What is slow, as heat is: without a division.
    if whole.abs() < 0.01 {
        let square = whole * whole;
        let third = (1.0 / 6.0 - whole * (1.0 / 24.0)) + square * (1.0 / 120.0 - whole * (1.0 / 720.0));
        return whole - square * (0.5 - whole * third);
    }
    if whole.abs() < 0.5 {
        let tangent = small_tanh(0.5 * whole);
        return 2.0 * tangent / (1.0 + tangent);
    }
    // An infinite rate has no lag.
    1.0 - (-whole).exp()
}

/// Spans that differ by less than this share are the same: times are written with few digits, and a regular grid differs from itself
/// by rounding only.
pub(crate) const SAME_SPAN: f64 = 1e-9;

/// The [`step_response`] of one lag from row to row, made once for neighbours of one interval.
pub(crate) struct RowResponse {
    rate: f64,
    /// [s] the interval that it was made for; not-a-number = none yet.
    span: f64,
    response: f64,
}

impl RowResponse {
    /// At a pole of `rate` [rad/s].
    pub(crate) fn of(rate: f64) -> Self {
        Self { rate, span: f64::NAN, response: 0.0 }
    }

    /// Over an interval [s].
    #[inline]
    pub(crate) fn over(&mut self, span: f64) -> f64 {
        if self.span.is_nan() || (self.span - span).abs() > SAME_SPAN * span {
            (self.span, self.response) = (span, step_response(self.rate, span));
        }
        self.response
    }
}

/// The hyperbolic tangent, to the last digits but one. A fit asks for it, and for [`step_response`], a hundred million times, and
/// the library's takes three times as long.
#[must_use]
pub(crate) fn tanh(value: f64) -> f64 {
    match value.abs() {
        small if small < 0.25 => small_tanh(value),
        // One to the last digit, as of most friction.
        large if large > 20.0 => value.signum(),
        _ => 1.0 - 2.0 / ((2.0 * value).exp() + 1.0),
    }
}

/// The sine, to the last digit. Most benches turn by less than an eighth of a circle, where a series does: asked for as often,
/// and the library's takes three times as long.
#[must_use]
pub(crate) fn sin(angle: f64) -> f64 {
    if angle.abs() > std::f64::consts::FRAC_PI_4 {
        return angle.sin();
    }
    let square = angle * angle;
    // 1/3!, 1/5! and so on: what follows is below 1e-17 of it.
    const TERMS: [f64; 8] = [
        -1.0 / 6.0,
        1.0 / 120.0,
        -1.0 / 5040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 1_307_674_368_000.0,
        1.0 / 355_687_428_096_000.0,
    ];
    // In pairs (Estrin): one term after the other each would wait for the one before.
    let [a, b, c, d, e, f, g, h] = TERMS;
    let fourth = square * square;
    let low = (a + b * square) + fourth * (c + d * square);
    let high = (e + f * square) + fourth * (g + h * square);
    angle + angle * square * (low + fourth * fourth * high)
}

/// Up to a quarter: there the sixth convergent of Lambert's continued fraction is right to the last digit.
fn small_tanh(value: f64) -> f64 {
    let square = value * value;
    value * (10_395.0 + square * (1260.0 + 21.0 * square))
        / (10_395.0 + square * (4725.0 + square * (210.0 + square)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the library's own, on both sides of where they change over.
    #[test]
    fn the_quick_functions_are_the_functions() {
        let near = |ours: f64, theirs: f64| (ours - theirs).abs() <= 2e-15 * theirs.abs();
        for step in -40_000..=40_000 {
            let value = 1e-3 * f64::from(step);
            assert!(near(tanh(value), value.tanh()), "tanh {value}");
            assert!(near(sin(value), value.sin()), "sin {value}");
            assert!(near(step_response(value.abs(), 0.1), -(-0.1 * value.abs()).exp_m1()), "{value}");
        }
        assert_eq!((step_response(f64::INFINITY, 1.0), tanh(f64::INFINITY), tanh(-1e3)), (1.0, 1.0, -1.0));
        assert!(tanh(f64::NAN).is_nan() && step_response(f64::NAN, 1.0).is_nan());
    }
}
