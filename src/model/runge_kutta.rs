//! The classical Runge-Kutta step (Kutta 1901) of a rate that goes to a moving z.

const SIXTH: f64 = 1.0 / 6.0;

/// What one classical Runge-Kutta step of the bare law goes of the ways to z at its begin, middle and end: of a linear law it
/// is a sum, whose weights a span has in common. `way` is pole times step. As [`runge_kutta`], in a third of the time.
pub(super) fn step_weights(way: f64) -> [f64; 3] {
    let begin = way * (1.0 - way * (1.0 - way * (0.5 - 0.25 * way)));
    let middle = way * (4.0 - way * (2.0 - 0.5 * way));
    [begin * SIXTH, middle * SIXTH, way * SIXTH]
}

/// One classical Runge-Kutta step of a rate whose acceleration depends on itself and on z, which is given at the begin,
/// the middle and the end.
#[inline]
pub(super) fn runge_kutta(
    mut acceleration: impl FnMut(f64, f64) -> f64,
    rate: f64,
    z: [f64; 3],
    step: f64,
) -> f64 {
    let first = acceleration(rate, z[0]);
    let second = acceleration(rate + 0.5 * step * first, z[1]);
    let third = acceleration(rate + 0.5 * step * second, z[1]);
    let fourth = acceleration(rate + step * third, z[2]);
    rate + step / 6.0 * (first + 2.0 * (second + third) + fourth)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_of_a_step_are_those_of_runge_and_kutta() {
        for way in [1e-3, 0.1, 0.35, 1.0] {
            let (pole, rate, z) = (20.0, 500.0, [600.0, 650.0, 680.0]);
            let weights = step_weights(way);
            let short = rate + z.iter().zip(weights).map(|(z, weight)| weight * (z - rate)).sum::<f64>();
            let long = runge_kutta(|rate, z| pole * (z - rate), rate, z, way / pole);
            // Sums of a dozen terms of 700, in another order.
            assert!((short - long).abs() < 1e-11, "{way}: {short} and {long}");
        }
    }
}
