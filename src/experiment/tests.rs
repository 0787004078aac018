//! Every shape slot by slot, and what is refused.

use crate::experiment::*;
use crate::guard::Limits;

fn config(shape: Waveform) -> ExperimentConfig {
    ExperimentConfig { shape, rotors: Rotors::One, around: 0.46, lead_in_s: 2.0 }
}

fn levels(experiment: &Experiment) -> Vec<f64> {
    (experiment.lead_in()..experiment.slots()).map(|slot| experiment.command(slot)[0]).collect()
}

#[test]
fn constant_levels_are_held_one_after_another() {
    let shape = Waveform::Constant { levels: vec![0.3, 0.5, 0.4], hold_s: 0.06 };
    let experiment = config(shape).build(0.02).expect("valid");
    let expected = [0.3, 0.3, 0.3, 0.5, 0.5, 0.5, 0.4, 0.4, 0.4];
    for (value, expected) in levels(&experiment).iter().zip(expected) {
        assert!((value - expected).abs() < 1e-12);
    }
    assert_eq!(experiment.slots() - experiment.lead_in(), 9);
}

#[test]
fn the_lead_in_rises_from_rest_and_waits_at_the_first_command() {
    let shape = Waveform::Constant { levels: vec![0.4], hold_s: 1.0 };
    let experiment = config(shape).build(0.02).expect("valid");
    assert_eq!(experiment.lead_in(), 100);
    assert!(experiment.command(0)[0] < 0.01);
    assert!((experiment.command(49)[0] - 0.4).abs() < 1e-12);
    assert!((experiment.command(99)[0] - 0.4).abs() < 1e-12);
}

#[test]
fn ramps_meet_both_ends_with_their_slope() {
    let shape = Waveform::Ramp { low: 0.2, high: 0.6, slope: 0.1, cycles: 2 };
    let experiment = config(shape).build(0.02).expect("valid");
    let levels = levels(&experiment);
    assert_eq!(levels.len(), 800);
    let (low, high) = levels.iter().fold((1.0_f64, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    assert!((low - 0.2).abs() < 1e-12 && (high - 0.6).abs() < 1e-12);
    for pair in levels.windows(2) {
        assert!(((pair[1] - pair[0]).abs() - 0.002).abs() < 1e-9);
    }
}

#[test]
fn a_prbs_keeps_its_levels_bandwidth_and_seed() {
    let shape = |bandwidth_hz, seed| Waveform::Prbs { amplitude: 0.1, bandwidth_hz, duration_s: 20.0, seed };
    let full = levels(&config(shape(0.0, 1)).build(0.02).expect("valid"));
    assert_eq!(full.len(), 1000);
    assert!(full.iter().all(|v| (v - 0.56).abs() < 1e-12 || (v - 0.36).abs() < 1e-12));
    assert_ne!(full, levels(&config(shape(0.0, 2)).build(0.02).expect("valid")));
    // 0.443 / 5 Hz = 88 ms: four periods of 20 ms.
    let slow = levels(&config(shape(5.0, 1)).build(0.02).expect("valid"));
    assert!(slow.chunks(4).all(|chip| chip.iter().all(|value| *value == chip[0])));
}

#[test]
fn a_chirp_begins_and_ends_at_its_frequencies() {
    let shape = Waveform::Chirp { amplitude: 0.05, from_hz: 0.5, to_hz: 8.0, duration_s: 30.0 };
    let experiment = config(shape).build(0.002).expect("valid");
    let values: Vec<f64> = levels(&experiment).iter().map(|value| value - 0.46).collect();
    let crossings = |part: &[f64]| part.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
    assert_eq!(crossings(&values[..1500]) + 1, 2, "1.5 turns or so in the first 3 s");
    assert!((7..=8).contains(&crossings(&values[14_500..])), "8 Hz in the last second");
}

#[test]
fn differential_commands_are_symmetric() {
    let shape = Waveform::Steps { amplitude: 0.05, hold_s: 0.5, count: 12 };
    let experiment =
        ExperimentConfig { rotors: Rotors::Differential, ..config(shape) }.build(0.02).expect("valid");
    for slot in experiment.lead_in()..experiment.slots() {
        let [first, second] = experiment.command(slot);
        assert!((first + second - 0.92).abs() < 1e-12);
    }
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let refuse = |shape| config(shape).build(0.02).expect_err("must be refused").to_string();
    let prbs =
        |amplitude, bandwidth_hz, duration_s| Waveform::Prbs { amplitude, bandwidth_hz, duration_s, seed: 1 };
    assert!(refuse(prbs(0.6, 0.0, 10.0)).contains("a command lies in 0..1"));
    assert!(refuse(prbs(0.1, 30.0, 10.0)).contains("`bandwidth_hz` must lie in 0..25"));
    assert!(refuse(prbs(0.1, 0.0, f64::NAN)).contains("`duration_s`"));
    let ramp = |low, high, slope| Waveform::Ramp { low, high, slope, cycles: 1 };
    assert!(refuse(ramp(0.3, 0.7, 50.0)).contains("`slope` must lie in 0.0001.."));
    assert!(refuse(ramp(0.3, 0.3, 0.1)).contains("`slope`"));
    assert!(refuse(ramp(0.7, 0.25, 0.1)).contains("`low`, 0.7, must lie below its `high`, 0.25"));
    assert!(refuse(Waveform::Constant { levels: vec![], hold_s: 1.0 }).contains("levels"));
    assert!(refuse(Waveform::Constant { levels: vec![f64::NAN], hold_s: 1.0 }).contains("0..1"));
}

#[test]
fn the_guards_limits_are_named_when_they_would_clip() {
    let limits = Limits { maximum: 0.5, slew_per_s: 3.0 };
    let check = |shape| config(shape).build(0.02).expect("valid").check(&limits);
    assert_eq!(check(Waveform::Constant { levels: vec![0.48], hold_s: 1.0 }), Ok(()));
    let high = check(Waveform::Constant { levels: vec![0.48, 0.52], hold_s: 1.0 }).unwrap_err();
    assert_eq!(
        high.to_string(),
        "the guard's limit `rotor_maximum` = 0.5 would clip the experiment: rotor 1 is commanded to 0.5200 at 3.00 s"
    );
    let fast = check(Waveform::Constant { levels: vec![0.40, 0.48], hold_s: 1.0 }).unwrap_err();
    assert!(
        fast.to_string().contains("`slew_per_s` = 3 1/s") && fast.to_string().contains("4.00 1/s"),
        "{fast}"
    );
}
