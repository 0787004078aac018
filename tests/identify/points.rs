//! Points of a thrust stand: a row a level, no time worth the name.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
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
