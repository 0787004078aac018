//! What is behind a sensor with laws of its own.

use std::borrow::Cow;

use super::with_law;
use crate::effect::Site;
use crate::model::*;

/// Rows of 100 Hz on which a body swings by itself.
fn swing() -> (Vec<f64>, Vec<f64>) {
    let time: Vec<f64> = (0..400).map(|row| 0.01 * f64::from(row)).collect();
    let rate = time.iter().map(|at| 1.5 * (4.0 * at).sin()).collect();
    (time, rate)
}

/// By least squares over rows of 100 Hz.
fn slope(of: &[f64], row: usize, half: usize) -> f64 {
    let (mut up, mut spread) = (0.0, 0.0);
    for step in 1..=half {
        let apart = 0.01 * step as f64;
        up += apart * (of[row + step] - of[row - step]);
        spread += 2.0 * apart * apart;
    }
    up / spread
}

fn with(laws: &[(&str, f64)]) -> Equations {
    let mut model = Model::paper();
    for (name, value) in laws {
        let (id, _) = name.split_once('.').expect("of an effect");
        model = model.with(&model.effect(id).expect("known"));
        model.set_parameter(name, *value);
    }
    model.equations().expect("binds")
}

#[test]
fn the_rate_behind_a_gyroscope_is_the_body_s() {
    let (time, rate) = swing();
    let laws = [("gyro_bias.bias", 0.2), ("gyro_scale.scale", 0.9), ("gyro_lag.pole", 25.0)];
    // The slope of a swing of 4 rad/s over 40 ms is 0.1 % less than it is, of a lag of 0.24 rad/s.
    for (count, most) in [(0, 1e-12), (1, 1e-9), (2, 1e-9), (3, 1e-3)] {
        let equations = with(&laws[..count]);
        let shown = equations.gyroscope(&time, &rate, &vec![0.0; time.len()]);
        let inverse = equations.gyroscope_inverse(0.01);
        assert_eq!(inverse.lag_s != 0.0, count == 3);
        for row in 50..time.len() - 3 {
            let reading = (time[row], 0.3, shown[row]);
            let start = equations.start_behind(&inverse, reading, |half| slope(&shown, row, half));
            assert!((start.rate - rate[row]).abs() < most, "{count} laws, {row}: {start:?}, {}", rate[row]);
            // A run that starts there shows what was read.
            let input = BodyInput {
                time: time.clone().into(),
                torque: vec![0.0; time.len()],
                propeller_rate: Default::default(),
            };
            let mut trace = BodyTrace::default();
            equations.simulate_body(&input, row, row + 1, &start, &mut trace);
            assert!((trace.rate[0] - shown[row]).abs() < 1e-9, "{count} laws, {row}: {}", trace.rate[0]);
        }
    }
}

/// The lag is the same whatever else a sensor does: an offset, a drift, a bend.
#[test]
fn a_law_beside_a_lag_does_not_change_it() {
    for (site, law, lag) in [
        (Site::RotorRateSensor, "-5", "telemetry_lag.pole"),
        (Site::RotorRateSensor, "0.02*propeller_rate", "telemetry_lag.pole"),
        (Site::BodyRateSensor, "0.01*time_s", "gyro_lag.pole"),
        (Site::BodyRateSensor, "0.002*body_rate^2", "gyro_lag.pole"),
    ] {
        for pole in [1.5, 25.0] {
            let model = with_law(site, law);
            let (id, _) = lag.split_once('.').expect("of an effect");
            let mut model = model.with(&model.effect(id).expect("known"));
            model.set_parameter(lag, pole);
            let equations = model.equations().expect("binds");
            let found = if site == Site::BodyRateSensor {
                equations.gyroscope_inverse(0.01)
            } else {
                equations.telemetry_inverse(0.01)
            };
            // What comes before the lag is late, too: a drift adds a hundredth of the lag, the square a quarter of that.
            let most = 0.02;
            assert!((found.lag_s * pole - 1.0).abs() < most, "{law}, {pole}: {found:?}");
        }
    }
}

#[test]
fn rotors_turn_ahead_of_a_late_telemetry() {
    let equations = with(&[("telemetry_lag.pole", 40.0)]);
    let inverse = equations.telemetry_inverse(0.01);
    assert!((inverse.lag_s - 0.025).abs() < 2e-4, "{inverse:?}");
    let (time, rate) = swing();
    // A lag of 25 ms of a swing, in the closed form.
    let (pole, swing) = (40.0, 4.0);
    let shown: Vec<f64> = time
        .iter()
        .map(|at| {
            let (sine, cosine) = (swing * at).sin_cos();
            1.5 * pole * (pole * sine - swing * cosine) / (pole * pole + swing * swing)
        })
        .collect();
    let slopes = |of: &[f64], half: usize| {
        let within = |row: usize| row >= half && row + half < of.len();
        (0..of.len()).map(|row| if within(row) { slope(of, row, half) } else { 0.0 }).collect()
    };
    let behind = equations.rates_behind(&inverse, Cow::Borrowed(&shown), slopes);
    for row in 3..time.len() - 3 {
        assert!((behind[row] - rate[row]).abs() < 2e-3, "{row}: {} {}", behind[row], rate[row]);
    }
    assert_eq!(with(&[]).telemetry_inverse(0.01), LagInverse::NONE);
    assert_eq!(with(&[]).rates_behind(&LagInverse::NONE, Cow::Borrowed(&shown), slopes), shown);
}
