//! Points of a thrust stand: a row a level, no time worth the name.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rotorbench::compare::{CompareConfig, CompareError, compare};
use rotorbench::experiment::Waveform;
use rotorbench::identify::{
    Estimate, Identification, IdentifyError, IdentifySettings, check_columns, identify,
};
use rotorbench::log::Dataset;
use rotorbench::model::Model;
use rotorbench::screening::{ScreeningError, screened};

use super::bench::{bench, prbs, run};

/// [rad/s] noise of an average.
const NOISE: f64 = 1.0;

/// Levels from 0.2 to 0.9 at a supply of `volts`, `pause` [s] apart: a curve with k_V = 40 rad/(s V) and c = 1.6e-5 N s²/rad².
fn table(name: &str, volts: f64, pause: f64, levels: usize) -> Dataset {
    let mut noise = ChaCha8Rng::seed_from_u64(volts.to_bits());
    let command = |row: usize| 0.2 + 0.7 * row as f64 / (levels - 1) as f64;
    let rate = |row: usize| command(row) * (1124.5 + 447.1 * command(row)) - 40.0 * (12.6 - volts);
    let mut log = Dataset::new(name, "", (0..levels).map(|row| pause * row as f64).collect()).expect("rises");
    let mut add = |name: &str, of: &mut dyn FnMut(usize) -> f64| {
        log.insert(name, (0..levels).map(of).collect()).expect("fits");
    };
    add("command_1", &mut |row| command(row));
    add("battery_voltage_v", &mut |_| volts);
    add("propeller_rate_1_rad_s", &mut |row| rate(row) + NOISE * noise.sample::<f64, _>(StandardNormal));
    add("thrust_1_n", &mut |row| 1.6e-5 * rate(row).powi(2));
    log
}

fn found(logs: &[Dataset]) -> Result<Identification, IdentifyError> {
    identify(&screened(logs), &[], &IdentifySettings::default())
}

fn within(name: &str, estimate: Estimate, truth: f64) {
    assert!(estimate.distance(truth) < 3.0, "{name}: {estimate:?}, and it is {truth}");
}

#[test]
fn points_at_several_supplies_give_curve_gain_and_thrust_and_no_pole() {
    let supplies = [("a.csv", 12.6), ("b.csv", 11.4), ("c.csv", 10.2)];
    let logs: Vec<Dataset> = supplies.iter().map(|(name, volts)| table(name, *volts, 5.0, 15)).collect();
    let found = found(&logs).expect("points");
    let curve = found.static_curve.as_ref().expect("a curve");
    within("c_g2", curve.coefficients[0], 1124.5);
    within("c_g1", curve.coefficients[1], 447.1);
    // Noise of an average, 45 of them.
    assert!((0.7 * NOISE..1.3 * NOISE).contains(&curve.residual_rms), "{curve:?}");
    within("k_V", found.supplies.as_ref().expect("three supplies").gain, 40.0);
    let thrust = found.thrust.as_ref().expect("thrust was measured").coefficient;
    assert!((thrust.value / 1.6e-5 - 1.0).abs() < 0.01, "{thrust:?}");
    assert!(found.pole.is_none() && found.joint.is_none(), "nothing shows how the rotor follows");
    assert_eq!(found.model.actuator.pole, Model::paper().actuator.pole);
    assert!(found.findings.iter().any(|it| it.code == "pole_from_template"), "{:?}", found.findings);
    // Held against the curve, and not against a run from row to row.
    assert!(found.training.iter().all(|it| it.samples == 15 && it.rms < 1.5 * NOISE), "{:?}", found.training);
    assert!(found.model.rotor_error.is_none(), "no run shows how far the rotor is from the model");
    assert!(!found.findings.iter().any(|it| it.code == "rates_lead_commands"), "{:?}", found.findings);
    let said = found.findings.iter().filter(|it| it.code == "rows_are_levels");
    assert_eq!(said.map(|it| (it.log.as_str(), it.rows)).collect::<Vec<_>>(), supplies.map(|it| (it.0, 15)));
}

/// One table of six levels is enough for a curve and a thrust curve, and five are not.
#[test]
fn six_points_are_enough() {
    let of = |levels: usize| found(&[table("a.csv", 12.6, 10.0, levels)]);
    let six = of(6).expect("points");
    // An average is off by 1 rad/s, and six of them make the curve.
    let middle = six.actuator.steady_rate(0.5, Some(12.6)) - 0.5 * (1124.5 + 0.5 * 447.1);
    assert!(six.static_curve.is_some() && middle.abs() < 3.0 * NOISE, "{middle}");
    assert!(six.thrust.is_some());
    assert_eq!(six.training.iter().map(|it| it.samples).collect::<Vec<_>>(), [6]);
    assert!(of(5).is_err_and(|error| matches!(error, IdentifyError::Nothing { .. })));
}

/// An operator's pauses are as they are: none of the levels is lost.
#[test]
fn uneven_pauses_lose_no_point() {
    let even = table("a.csv", 12.6, 5.0, 12);
    let mut now = 0.0;
    let pauses = [5.0, 5.0, 30.0, 8.0, 40.0, 3.0, 60.0, 5.0, 25.0, 5.0, 90.0, 4.0];
    let time = pauses.iter().map(|pause| (now, now += pause).0).collect();
    let mut log = Dataset::new("a.csv", "", time).expect("rises");
    for name in ["command_1", "propeller_rate_1_rad_s"] {
        log.insert(name, even.column(name).expect("measured").to_vec()).expect("fits");
    }
    assert_eq!(found(&[log]).expect("points").static_curve.expect("a curve").samples, 12);
}

/// Beside a log that shows how the rotor follows, and with it the curve, a few points do not take its place.
#[test]
fn points_beside_an_experiment_leave_it_its_curve() {
    let experiment = run(&bench(11), prbs(60.0, 3), "prbs.csv");
    let alone = found(std::slice::from_ref(&experiment)).expect("an experiment");
    let beside = found(&[experiment, table("a.csv", 12.0, 5.0, 8)]).expect("both");
    assert!(alone.static_curve.is_none() && beside.static_curve.is_none(), "{:?}", beside.static_curve);
    assert_eq!(alone.joint.expect("steps").samples, beside.joint.expect("steps").samples);
}

/// Who searches for effects cannot: they are refused, not taken for a rotor that answers before it is asked.
#[test]
fn points_are_no_experiment() {
    let refused = check_columns(&screened(&[table("a.csv", 12.0, 5.0, 15)]), &Model::paper());
    let is_of_levels =
        |error: ScreeningError| matches!(error, ScreeningError::Column(it) if it.code == "rows_are_levels");
    assert!(refused.is_err_and(is_of_levels));
}

/// Given a clock that they do not have, they would be rates that lead their commands by half a row, with a pole of 70,000 rad/s.
#[test]
fn points_with_a_clock_that_they_do_not_have_are_asked_about() {
    // Of rows a tenth of a second apart there are rotors that answer within half of it.
    for pause in [0.001, 0.01] {
        // Not one level after the other: behind steps that are all alike a lag looks like another curve.
        let mut log = table("a.csv", 12.6, pause, 15);
        for name in ["command_1", "propeller_rate_1_rad_s", "thrust_1_n"] {
            let values = log.column(name).expect("measured").to_vec();
            log.replace(name, (0..15).map(|row| values[row * 7 % 15]).collect()).expect("as long");
        }
        let error = found(&[log]).expect_err("no rotor answers within a row");
        let IdentifyError::Screening(ScreeningError::Column(asked)) = error else { panic!("{error:?}") };
        assert_eq!((asked.code, asked.number("interval_s")), ("rates_answer_at_once", pause));
    }
}

/// A rotor that may answer within half a row that long is not refused.
#[test]
fn rows_far_apart_say_nothing_of_a_fast_pole() {
    let mut log = table("a.csv", 12.6, 0.1, 15);
    for name in ["command_1", "propeller_rate_1_rad_s", "thrust_1_n"] {
        let values = log.column(name).expect("measured").to_vec();
        log.replace(name, (0..15).map(|row| values[row * 7 % 15]).collect()).expect("as long");
    }
    let said = check_columns(&screened(&[log]), &Model::paper()).expect("not refused");
    assert!(said.iter().any(|it| it.code == "rates_lead_commands"), "{said:?}");
}

/// Four seconds of steps at 50 Hz whose milliseconds are read as seconds are no table.
#[test]
fn steps_in_another_unit_of_time_are_no_levels() {
    // Half a second at each level.
    let second = run(&bench(11), Waveform::Steps { amplitude: 0.08, hold_s: 0.5, count: 30 }, "ms.csv");
    let rows = 300..500;
    let time = second.time()[rows.clone()].iter().map(|time| 1000.0 * time).collect();
    let mut log = Dataset::new("ms.csv", "", time).expect("rises");
    for name in ["command_1", "propeller_rate_1_rad_s"] {
        log.insert(name, second.column(name).expect("measured")[rows.clone()].to_vec()).expect("fits");
    }
    let error = found(&[log]).expect_err("refused");
    let IdentifyError::Screening(ScreeningError::Column(asked)) = error else { panic!("{error:?}") };
    assert_eq!(asked.code, "samples_too_far_apart");
}

/// A cell without a command is a level of nothing; `compare` has no run to show, however many rows there are.
#[test]
fn a_level_without_its_command_is_left_out_and_a_long_table_is_not_compared() {
    let mut log = table("a.csv", 12.6, 5.0, 60);
    let mut commands = log.column("command_1").expect("logged").to_vec();
    commands[30] = f64::NAN;
    log.replace("command_1", commands).expect("as long");
    let samples = found(std::slice::from_ref(&log)).expect("points").static_curve.expect("a curve").samples;
    assert_eq!(samples, 59);
    let refused = compare(&[Model::paper()], &log.into(), &CompareConfig::default()).expect_err("no run");
    let CompareError::Screening(ScreeningError::Column(why)) = refused else { panic!("{refused:?}") };
    assert_eq!(why.code, "rows_are_levels");
}
