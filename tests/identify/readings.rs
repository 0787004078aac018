//! Readings that a logger repeats, and readings that are none.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rotorbench::emulate::EmulatorConfig;
use rotorbench::identify::{Estimate, Identification, IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::screening::screened;

use super::bench::{bench, prbs, run};

const RATE: &str = "propeller_rate_1_rad_s";

/// Each rate of `log` written again until a fresh one comes, which `fresh` names by its row.
fn held(log: &Dataset, fresh: impl Fn(usize) -> bool) -> Dataset {
    let mut last = f64::NAN;
    let rates = log.column(RATE).expect("measured").iter().enumerate().map(|(row, rate)| {
        last = if fresh(row) { *rate } else { last };
        last
    });
    let rates = rates.collect();
    let mut log = log.clone();
    log.replace(RATE, rates).expect("as long");
    log
}

/// The numbers of the paper's bench within 3 standard errors, and a delay or none, as there is one.
fn holds(case: &str, found: &Identification, delay: f64) {
    let joint = found.joint.as_ref().expect("exciting commands");
    let found = joint.delay.as_ref().map_or(0.0, |it| it.delay.value);
    // A fiftieth of a sample, as where every row holds a reading of its own.
    assert!((found - delay).abs() < 4e-4, "{case}: {delay} s, {:?}", joint.delay);
    assert!(joint.residual_correlation < 0.1, "{case}: {}", joint.residual_correlation);
    // Nothing is left but the sensor's noise of 1.5 rad/s.
    assert!((1.35..1.65).contains(&joint.residual_rms), "{case}: {}", joint.residual_rms);
    let within = |name: &str, estimate: Estimate, truth: f64| {
        println!("{case}: {name} {estimate:?}, {:.2} standard errors", estimate.distance(truth));
        assert!(estimate.distance(truth) < 3.0, "{case}: {name} {estimate:?}");
    };
    within("p", joint.pole, 16.0);
    within("c_g2", joint.coefficients[0], 1124.5);
    within("c_g1", joint.coefficients[1], 447.1);
    within("k_V", joint.voltage_gain.expect("voltage was logged"), 40.0);
}

fn settings() -> IdentifySettings {
    IdentifySettings { degree: Some(2), ..IdentifySettings::default() }
}

#[test]
fn readings_that_repeat_are_no_further_delay_and_no_slow_pole() {
    of_readings_that_repeat(0.03);
}

fn of_readings_that_repeat(delay: f64) {
    type Fresh = fn(usize) -> bool;
    let patterns: [(&str, Fresh); 3] = [
        ("every second", |row| row.is_multiple_of(2)),
        ("every third", |row| row.is_multiple_of(3)),
        ("1-2-1-2", |row| row % 3 != 2),
    ];
    let whole = run(&EmulatorConfig { command_delay_s: delay, ..bench(11) }, prbs(600.0, 3), "held.csv");
    for (pattern, fresh) in patterns {
        let log = held(&whole, fresh);
        let found = identify(&screened(&[log]), &[], &settings()).expect("identified");
        let held = found.findings.iter().filter(|it| it.code == "sample_and_hold").count();
        assert_eq!(held, 1, "{pattern}: {:?}", found.findings);
        holds(&format!("{pattern}, {delay} s"), &found, delay);
    }
}

fn of_outliers(delay: f64) {
    type Wrong = fn(f64) -> f64;
    let wrong: [(&str, Wrong); 3] =
        [("5000 rad/s", |_| 5000.0), ("half", |rate| 0.5 * rate), ("double", |rate| 2.0 * rate)];
    let whole = run(&EmulatorConfig { command_delay_s: delay, ..bench(12) }, prbs(600.0, 4), "outliers.csv");
    for (name, with) in wrong {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let rates = whole.column(RATE).expect("measured").iter();
        let rates = rates.map(|rate| if random.random_bool(0.005) { with(*rate) } else { *rate }).collect();
        let mut log = whole.clone();
        log.replace(RATE, rates).expect("as long");
        let found = identify(&screened(&[log]), &[], &settings()).expect("identified");
        let outliers = found.findings.iter().filter(|it| it.code == "outliers").count();
        assert_eq!(outliers, 1, "{name}: {:?}", found.findings);
        holds(&format!("{name}, {delay} s"), &found, delay);
        // Fig. 5 is made of what lies between them.
        assert!(found.frequency_response.len() > 50, "{}", found.frequency_response.len());
    }
}

/// `tools/test --all` runs them.
mod at_length {
    use super::*;

    /// One row in 200 of rates that are none: with 5000 rad/s in them p came out as 5, with half of the speed k_V was lost.
    #[test]
    fn outliers_do_not_move_what_is_identified_of_a_late_rotor() {
        of_outliers(0.03);
    }

    /// With every second reading repeated a rotor seemed to have a dead time of 11 ms, with two of three as slow as 9 rad/s.
    #[test]
    fn readings_that_repeat_are_no_delay() {
        of_readings_that_repeat(0.0);
    }

    #[test]
    fn outliers_do_not_move_what_is_identified_without_a_delay() {
        of_outliers(0.0);
    }
}
