//! A battery that is read in steps.

use super::super::bench::{C_G1, C_G2, ColouredNoise, Count, FULL_VOLTAGE, K_V, POLE, RUNS, powered};
use crate::identify::{static_curve, steady_rows};
use crate::screening::quantized_voltage;
use crate::screening::rotor_data::RotorLog;

/// Ramps on a battery that gives way under the load, read in tenths of a volt. Seen with the choice of the degree broken: one
/// above two, from one standard error on, 13 times of 300.
#[test]
fn the_curve_behind_a_battery_read_in_steps() {
    let volts = |t: f64, rate: f64| 12.55 - 0.3 * t / 90.0 - 0.25 * (rate / 617.0).powi(3);
    let ramp = |t: f64| 0.25 + 0.45 * (1.0 - (t / 22.5).rem_euclid(2.0)).abs();
    let truth = powered(volts, ramp, POLE, 0.02, 4500);
    let mut counts = [("c_g2", C_G2), ("c_g1", C_G1)].map(|(n, t)| Count::new(n, t));
    let mut above = 0;
    for run in 0..RUNS as u64 {
        let noise = &mut ColouredNoise::new(9000 + run, 0.0);
        let exact = truth.voltage.as_deref().expect("there");
        let read = noise.white_on(exact, 0.02).iter().map(|volts| (10.0 * volts).round() / 10.0).collect();
        let mut log =
            RotorLog { rate: noise.on(&truth.rate, 1.5).into(), voltage: Some(read), ..truth.clone() };
        assert_eq!(quantized_voltage::mend(&mut log), None);
        let rows = steady_rows::steady_rows(&[log], K_V, FULL_VOLTAGE, false).expect("ramps");
        let curve = |degree| static_curve::identify(&rows, 0.0, degree, None).expect("a curve");
        above += usize::from(curve(None).preferred_degree > 2);
        let coefficients = curve(Some(2)).coefficients;
        counts.iter_mut().zip(coefficients).for_each(|(count, estimate)| count.take(estimate));
    }
    println!("a degree above two: {above} of {RUNS}");
    counts.iter().for_each(|count| count.check(0.0));
    assert!(above <= RUNS / 60, "a degree above two: {above} of {RUNS}");
}
