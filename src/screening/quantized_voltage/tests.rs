//! Staircases made from a voltage that is known.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::screening::quantized_voltage::*;

const ROWS: usize = 4500;

/// [V] 90 s in which a rotor of this rate [rad/s] takes three tenths of a volt at 617 rad/s, and the discharge as much.
fn volts(rate: f64, row: usize) -> f64 {
    12.57 - 0.3 * row as f64 / ROWS as f64 - 0.3 * (rate / 617.0).powi(3)
}

/// [rad/s] slow ramps, or a rate that hardly moves.
fn rate(row: usize, moves: bool) -> f64 {
    let place = (row as f64 / 1125.0).fract();
    if moves { 300.0 + 500.0 * (1.0 - (2.0 * place - 1.0).abs()) } else { 617.0 }
}

/// The log as it is read, and the voltage as it was.
fn read(step: f64, noise: f64, moves: bool) -> (RotorLog, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let truth: Vec<f64> = (0..ROWS).map(|row| volts(rate(row, moves), row)).collect();
    let mut noisy = |volts: &f64| volts + noise * random.sample::<f64, _>(StandardNormal);
    let read = truth.iter().map(|volts| (noisy(volts) / step).round() * step).collect();
    let log = RotorLog {
        file: "log.csv".to_owned(),
        number: 1,
        time: (0..ROWS).map(|row| 0.02 * row as f64).collect(),
        command: vec![0.4; ROWS].into(),
        command_from: None,
        delay_unknown: 0.0,
        delay_found: 0.0,
        rate: (0..ROWS).map(|row| rate(row, moves)).collect(),
        voltage: Some(read),
        voltage_gap: None,
        thrust: None,
        stretches: std::iter::once(0..ROWS).collect(),
        interval: 0.02,
        instrument: None,
        beside: None,
    };
    (log, truth)
}

/// [V] rms of what the log reads too much, on the mean of each 300 rows.
fn off(log: &RotorLog, truth: &[f64]) -> f64 {
    let read = log.voltage.as_deref().expect("there");
    let off: Vec<f64> = read.iter().zip(truth).map(|(read, truth)| read - truth).collect();
    let parts = off.chunks(300).map(|part| (part.iter().sum::<f64>() / part.len() as f64).powi(2));
    (parts.sum::<f64>() * 300.0 / ROWS as f64).sqrt()
}

#[test]
fn a_staircase_is_read_as_what_it_steps_over() {
    for moves in [true, false] {
        for (step, noise) in [(0.1, 0.0), (0.1, 0.005), (0.1, 0.02), (0.05, 0.005), (0.05, 0.02)] {
            let (mut log, truth) = read(step, noise, moves);
            let before = off(&log, &truth);
            assert_eq!(mend(&mut log), None);
            let after = off(&log, &truth);
            // Where the rate moves, the noise is strong or plateaus are short, 300 rows go over several.
            assert!(moves || noise > 0.06 * step || before > 0.2 * step, "{step} {noise}: {before}");
            assert!(after < 0.1 * step, "{step} {noise} {moves}: {before} to {after}");
        }
    }
}

#[test]
fn fine_steps_and_steps_below_the_noise_stay_as_they_were_read() {
    for (step, noise) in [(1e-9, 0.02), (0.01, 0.02), (0.05, 0.05)] {
        let (mut log, _) = read(step, noise, true);
        let before = log.voltage.clone();
        assert_eq!((mend(&mut log), log.voltage), (None, before), "{step} {noise}");
    }
}

#[test]
fn a_voltage_that_crosses_one_edge_is_found() {
    let (mut log, _) = read(0.5, 0.005, false);
    let before = log.voltage.clone();
    let finding = mend(&mut log).expect("found");
    assert_eq!((finding.code, finding.number("step_v")), ("battery_quantized", 0.5));
    assert_eq!(log.voltage, before);
}

/// One edge under either of two loads: what the load takes and how the voltage fell are one.
#[test]
fn an_edge_under_each_of_two_loads_is_found() {
    let (mut log, _) = read(0.1, 0.01, false);
    log.rate[ROWS / 2..].fill(750.0);
    let fell = |row: usize| 12.42 - 0.24 * row as f64 / ROWS as f64;
    log.voltage = Some((0..ROWS).map(|row| (fell(row) * 10.0).round() / 10.0).collect());
    assert!(mend(&mut log).is_some());
}

/// What drives a rotor is nearer to the voltage than the reading is, on a battery that empties unevenly, too: a fifth of its error where
/// a dozen edges show how it falls, and half of it where there are three. Where no course goes with time and load it is left as read.
#[test]
fn what_a_coarse_reading_steps_over_is_nearer_to_the_voltage() {
    let rms = |values: &[f64], truth: &[f64]| {
        let squares = values.iter().zip(truth).map(|(value, truth)| (value - truth).powi(2));
        (squares.sum::<f64>() / truth.len() as f64).sqrt()
    };
    for (step, noise, left) in [(0.1, 0.002, 0.65), (0.1, 0.01, 0.6), (0.05, 0.005, 0.3), (0.05, 0.02, 0.25)]
    {
        for moves in [true, false] {
            let mut random = ChaCha8Rng::seed_from_u64(8);
            let (mut log, even) = read(step, noise, moves);
            let uneven = |row: usize| 0.04 * (row as f64 / ROWS as f64 * 18.0).sin();
            let truth: Vec<f64> = (0..ROWS).map(|row| even[row] + uneven(row)).collect();
            let mut noisy = |volts: &f64| volts + noise * random.sample::<f64, _>(StandardNormal);
            log.voltage = Some(truth.iter().map(|volts| (noisy(volts) / step).round() * step).collect());
            let seen = seen_through(&log).expect("in steps");
            let (before, after) = (rms(log.voltage.as_deref().expect("there"), &truth), rms(&seen, &truth));
            assert!(after < left * before, "{step} {noise} {moves}: {before} to {after}");
        }
    }
    let (mut log, _) = read(0.1, 0.005, false);
    let switched = |row: usize| 12.0 + 0.3 * ((row / 37 * (row / 37) % 5) as f64);
    log.voltage = Some((0..ROWS).map(|row| (switched(row) * 10.0).round() / 10.0).collect());
    assert_eq!(seen_through(&log), None, "a supply that is switched");
    assert_eq!(seen_through(&read(1e-9, 0.02, true).0), None, "a fine reading");
}
