//! What a rotor's thrust is made of.

use std::collections::BTreeMap;

use rotorbench::model::{AddedEffect, Model};

use super::close;
use super::logs::{ARM, THRUST};

/// The nominal thrust is the same for every rotor and knows no wind; the rest is what a rotor's own speed through the air
/// does to it, here by k c ω_p v with v = ±d ω_b, and both together turn the body by Eq. (12).
#[test]
fn eqs_11_and_12_nominal_thrust_and_the_error_that_wind_makes() {
    const COEFFICIENT: f64 = 0.5;
    let mut windy = Model::paper();
    let parameters = BTreeMap::from([("coefficient".to_owned(), COEFFICIENT)]);
    windy.effects.push(AddedEffect { id: "inflow_damping".to_owned(), parameters });
    let [nominal, windy] = [Model::paper(), windy].map(|model| model.equations().expect("known effects"));
    for rate in [300.0, 617.0, 800.0] {
        for body_rate in [-2.0, 0.0, 0.7] {
            let [first, second] = [1.0, -1.0].map(|side| {
                let thrust = nominal.rotor_thrust(rate, side, 0.1, body_rate);
                // c to the five digits that the print gives: 5e-5 / 1.5965 of the thrust.
                close(thrust, THRUST * rate * rate, 3.2e-5 * thrust);
                let error = windy.rotor_thrust(rate, side, 0.1, body_rate) - thrust;
                let by_hand = -COEFFICIENT * THRUST * rate * (side * ARM * body_rate);
                close(error, by_hand, 3.2e-5 * by_hand.abs());
                (thrust, error)
            });
            close(first.0, second.0, 0.0);
            // Eq. (12): the nominal parts cancel, and e_p, the difference of the errors, is left, against the motion.
            let left = ARM * (first.0 + first.1 - second.0 - second.1);
            close(left, 2.0 * ARM * first.1, 1e-12);
            assert!(left * body_rate <= 0.0, "{left} N m at {body_rate} rad/s");
        }
    }
    // The paper's hover thrust.
    close(nominal.rotor_thrust(617.0, 1.0, 0.0, 0.0), 6.077, 1e-3);
}
