//! A body that was held still: a rotor is identified with the body clamped, and the log has the body's columns, too.
//!
//! By what its sensors and what drives it say, and not by a fit: rate and angle show nothing but their noise, while the thrust of the
//! two rotors is out of balance, or a torque is commanded. A body that is free and at rest under balanced rotors is another
//! thing: there the law says that it rests. That one rotor stands is no proof, either: on a bench with a counterweight it may.

use std::ops::Range;

use crate::estimation::moments::squares_about_mean;
use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::body::CheckedBody;
use crate::screening::channel::rates_of_both;
use crate::screening::channel_noise::ChannelNoise;
use crate::screening::rotor_data::RotorLog;
use crate::screening::thresholds::THRESHOLDS;
use crate::signal::ROTORS;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE, TORQUE_COMMAND};

/// The code: a body that does not move, whatever the torque on it.
pub const BODY_HELD: &str = "body_held_still";

/// The finding, where the body of a log was held still.
pub(crate) fn check(body: &CheckedBody) -> Option<Finding> {
    let CheckedBody { log, rate, rotors } = body;
    // What more rotors than two turn is no body of ours.
    if rotors.iter().any(|rotor| rotor.number > ROTORS && rotor.turns()) {
        return None;
    }
    let imbalance = imbalance(log, rotors);
    if imbalance <= THRESHOLDS.held_imbalance {
        return None;
    }
    let segments = log.segments();
    let of_rate = over_noise(log, rate, &segments);
    let of_angle = log.column(BODY_ANGLE).map_or(0.0, |angle| over_noise(log, angle, &segments));
    let rows = rate.iter().filter(|rate| rate.is_finite()).count();
    let finding = Finding::new(BODY_HELD, BODY_RATE).of(log.source_name()).rows(rows);
    let finding = finding.with("imbalance", imbalance).with("times_noise", of_rate);
    (of_rate.max(of_angle) <= THRESHOLDS.held_motion).then_some(finding)
}

/// How many times its noise a channel moves within short windows; what a sensor drifts meanwhile is no motion.
fn over_noise(log: &Dataset, values: &[f64], segments: &[Range<usize>]) -> f64 {
    let window = ((THRESHOLDS.held_window / log.median_interval()) as usize).max(2);
    let (mut squares, mut count) = (0.0, 0.0);
    for rows in segments.iter().flat_map(|rows| values[rows.clone()].chunks(window)) {
        let known = rows.iter().copied().filter(|value| value.is_finite());
        squares += squares_about_mean(known.clone()).1;
        count += known.count() as f64;
    }
    let moves = f64::sqrt(squares / f64::max(count, 1.0));
    let noise = ChannelNoise::of(values.iter().copied()).in_signal(values, segments);
    if moves > 0.0 { moves / noise } else { 0.0 }
}

/// [-] by how much of both rotors' thrust the one outdoes the other, on average; 1 under a commanded torque.
fn imbalance(log: &Dataset, rotors: &[&RotorLog]) -> f64 {
    if let [Some(first), Some(second)] = rates_of_both(log) {
        return of_squares(first, second);
    }
    if let Some(torque) = log.column(TORQUE_COMMAND) {
        return if torque.iter().any(|torque| torque.abs() > 0.0) { 1.0 } else { 0.0 };
    }
    let command = |number| Some(&rotors.iter().find(|rotor| rotor.number == number)?.command[..]);
    command(1).zip(command(2)).map_or(0.0, |(first, second)| of_squares(first, second))
}

/// Of two channels, each held until its next reading.
fn of_squares(first: &[f64], second: &[f64]) -> f64 {
    let mut newest = [f64::NAN; 2];
    let (mut apart, mut together) = (0.0, 0.0);
    for pair in first.iter().zip(second) {
        for (held, value) in newest.iter_mut().zip([pair.0, pair.1]) {
            *held = if value.is_finite() { *value } else { *held };
        }
        let [one, other] = newest.map(|value| value * value);
        if (one + other).is_finite() {
            apart += (one - other).abs();
            together += one + other;
        }
    }
    if together > 0.0 { apart / together } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::screening::ScreenedLog;
    use crate::screening::tests::noise_of;

    /// 50 Hz for 20 s: rotor 1 at levels, rotor 2 at `share` of them, and a body whose rate is noise of `noise`, and a wave of
    /// `wave` and a drift of 0.2 [rad/s].
    fn log(share: f64, noise: f64, wave: f64) -> ScreenedLog {
        let rows = 1000;
        let mut log =
            Dataset::new("log.csv", "", (0..rows).map(|row| 0.02 * f64::from(row)).collect()).expect("rises");
        let level = |row: i32| 0.4 + 0.02 * f64::from(row / 25 % 3);
        let jitter = |row: i32, of: u64| noise_of(row as usize, of);
        let body = |row: i32| {
            let t = 0.02 * f64::from(row);
            noise * jitter(row, 1) + wave * (3.0 * t).sin() + 0.01 * t
        };
        for (name, value) in [
            ("command_1", &level as &dyn Fn(i32) -> f64),
            ("propeller_rate_1_rad_s", &|row| 1300.0 * level(row) + jitter(row, 2)),
            ("propeller_rate_2_rad_s", &|row| 1300.0 * share * level(row) + jitter(row, 3)),
            (BODY_RATE, &body),
        ] {
            log.insert(name, (0..rows).map(value).collect()).expect("fits");
        }
        log.into()
    }

    #[test]
    fn a_body_is_held_that_rests_while_its_rotors_are_out_of_balance() {
        let is_held = |log: ScreenedLog| log.body().expect("a body").is_held();
        assert!(is_held(log(0.0, 0.004, 0.0)), "one rotor stands");
        assert!(is_held(log(0.9, 0.004, 0.0)), "one is slower");
        assert!(!is_held(log(0.0, 0.004, 0.1)), "it moves");
        assert!(!is_held(log(1.0, 0.004, 0.0)), "balanced: it is where it should be");
        let log = log(0.0, 0.004, 0.0);
        let found: Vec<&Finding> = log.findings().filter(|it| it.code == BODY_HELD).collect();
        assert_eq!((found.len(), found[0].rows, found[0].subject.as_str()), (1, 1000, BODY_RATE));
        assert_eq!(log.body().expect("a body").reason(500), Some(BODY_HELD));
    }
}
