//! Section III equation by equation.

use rotorbench::identify::{Identification, IdentifiedActuator, IdentifyError, IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::report::findings::sentence;
use rotorbench::screening::{Finding, ScreeningError, screened};

use super::close;
use super::logs::{
    ARM, C_G1, C_G2, FULL_VOLTAGE, INERTIA, K_V, PERIOD, POLE, THRUST, attitude, codes, exciting, finding,
    levels, moving, ramps, steady, z,
};

fn found(logs: &[Dataset], degree: Option<usize>) -> Identification {
    identify(&screened(logs), &[], &IdentifySettings { degree, ..IdentifySettings::default() })
        .expect("identified")
}

fn paper() -> IdentifiedActuator {
    IdentifiedActuator {
        coefficients: vec![C_G2, C_G1],
        voltage_gain: K_V,
        full_voltage: FULL_VOLTAGE,
        pole: POLE,
        delay: 0.0,
        thrust_coefficient: 1.5965e-5,
    }
}

#[test]
fn eq_2_with_the_command_held() {
    let log = moving(exciting, 500);
    let column = |name: &str| log.column(name).expect("put in above");
    let rates = paper().simulate(log.time(), column("command_1"), log.column("battery_voltage_v"));
    for (ours, measured) in rates.iter().zip(column("propeller_rate_1_rad_s")) {
        // The model holds the voltage over T_s, the bench above lets it fall: k_V 0.004 V/s 0.02 s at most,
        // and the midpoint rule is off by (p h)²/6 of the way, 4e-7 of 600 rad/s.
        close(*ours, *measured, K_V * 0.004 * PERIOD + 3e-4);
    }
}

#[test]
fn eq_4_the_stationary_gain_is_one() {
    let time: Vec<f64> = (0..200).map(|k| f64::from(k) * PERIOD).collect();
    let mut command = vec![0.3; 200];
    command[1..].fill(0.4633);
    let rates = paper().simulate(&time, &command, Some(&[11.6; 200]));
    // Four seconds are 64 time constants.
    close(rates[199], z(0.4633, 11.6), 1e-9);
    close(rates[199], 616.95 - 40.0, 0.05);
    // One time constant after the jump: 1 - 1/e of the way, as near as the grid comes to 62.5 ms.
    let share = (rates[4] - rates[1]) / (rates[199] - rates[1]);
    close(share, 1.0 - (-POLE * 3.0 * PERIOD).exp(), 1e-9);
}

#[test]
fn eqs_3_5_6_k_v_from_constant_commands() {
    let found = found(&[steady(levels, 6000)], None);
    let battery = found.battery.expect("six constant levels");
    assert_eq!(battery.levels.len(), 6);
    // Without noise Eq. (6) as printed and with the mean subtracted say the same.
    for level in &battery.levels {
        close(level.gain.value, K_V, 1e-6);
        close(level.as_printed, K_V, 1e-6);
    }
    close(battery.gain.value, K_V, 1e-6);
    close(battery.spread, 0.0, 1e-6);
}

#[test]
fn eqs_7_8_9_the_polynomial_from_ramps() {
    let found = found(&[steady(levels, 6000), steady(ramps, 7000)], None);
    let curve = found.static_curve.expect("ramps");
    assert!(curve.from_ramps);
    assert_eq!(curve.preferred_degree, 2);
    close(curve.coefficients[0].value, C_G2, 1e-4);
    close(curve.coefficients[1].value, C_G1, 1e-4);
    // Of degree one there must be an error left, of three none that is less.
    assert!(curve.degrees[0].held_out > 10.0 && curve.degrees[2].held_out < 1e-6, "{:?}", curve.degrees);
}

#[test]
fn eq_9_says_when_a_ramp_is_too_fast_for_eq_4() {
    let fast = |t: f64| 0.3 + 0.1 * (3.5 - (t.rem_euclid(7.0) - 3.5).abs());
    let slow = found(&[steady(levels, 6000), moving(ramps, 7000)], Some(2));
    let fast = found(&[steady(levels, 6000), moving(fast, 7000)], Some(2));
    let codes = codes(&fast);
    let slow = slow.static_curve.and_then(|curve| curve.ramp_check).expect("ramps");
    assert!(slow.slow_enough, "{slow:?}");
    // 1/p, and half of T_s for the hold.
    close(slow.lag.value, 1.0 / POLE + 0.5 * PERIOD, 2e-3);
    let check = fast.static_curve.and_then(|curve| curve.ramp_check).expect("ramps");
    assert!(!check.slow_enough, "{check:?}");
    assert!(codes.contains(&"ramps_too_fast"), "{codes:?}");
}

/// Slow ramps that go one way over a narrow range: the lag is one with the curve, and what noise makes of it is none.
#[test]
fn eq_9_ramps_one_way_do_not_tell_a_lag_from_the_curve() {
    let noise = |row: usize| 6.0 * ((row.wrapping_mul(2_654_435_761) >> 16 & 255) as f64 / 127.5 - 1.0);
    for low in [0.35, 0.4, 0.45] {
        let mut log = moving(move |t| low + 0.0025 * t, 3000);
        let rates = log.column("propeller_rate_1_rad_s").expect("there").to_vec();
        let noisy = rates.iter().enumerate().map(|(row, rate)| rate + noise(row)).collect();
        log.replace("propeller_rate_1_rad_s", noisy).expect("as long as before");
        let found = found(&[log], Some(2));
        assert!(finding(&found, "ramps_too_fast").is_none(), "{:?}", found.findings);
        let check = found.static_curve.and_then(|curve| curve.ramp_check).expect("a ramp");
        // Half a percent of what the curve spans, 230 rad/s: believed, that lag would be called too large.
        assert!(
            check.error > 0.0055 * 230.0 && check.lag.value < 2.0 * check.lag.standard_error,
            "{check:?}"
        );
        assert!(check.slow_enough, "{check:?}");
    }
}

#[test]
fn eq_10_the_pole_from_z() {
    let logs = [steady(levels, 6000), steady(ramps, 7000), moving(exciting, 6000)];
    let found = found(&logs, Some(2));
    let fit = found.pole.expect("exciting commands");
    // What the fitter takes as held, the mean of the voltage over T_s, moves the rate by 1e-6 of itself.
    close(fit.pole.value, POLE, 1e-3);
    close(fit.gain.value, 1.0, 1e-4);
    let joint = found.joint.expect("exciting commands");
    close(joint.pole.value, POLE, 1e-3);
    close(joint.coefficients[1].value, C_G1, 0.1);
    close(joint.voltage_gain.expect("voltage was logged").value, K_V, 0.05);
}

#[test]
fn eq_13_the_thrust_curve_and_its_tangent() {
    let log_with = |thrust: &dyn Fn(f64) -> f64| {
        let mut log = moving(exciting, 3000);
        let rates = log.column("propeller_rate_1_rad_s").expect("put in above");
        let thrusts = rates.iter().map(|rate| thrust(*rate)).collect();
        log.insert("thrust_1_n", thrusts).expect("as long as time");
        log
    };
    let with_thrust = |thrust: &dyn Fn(f64) -> f64| found(&[log_with(thrust)], Some(2));
    let quadratic = with_thrust(&|rate| THRUST * rate * rate);
    let thrust = quadratic.thrust.expect("thrust was measured");
    close(thrust.coefficient.value, THRUST, 1e-15);
    // The printed tangent at hover, to the digits of the printed c: 0.0197 N s/rad and -6.0771 N.
    close(thrust.slope.value, 0.0197, 5e-6);
    close(thrust.offset.value, -6.0771, 5e-4);
    close(thrust.linear_share.value, 0.0, 1e-9);
    let speaks_of_thrust = |found: &[Finding]| found.iter().any(|it| it.code.starts_with("thrust"));
    assert!(!speaks_of_thrust(&quadratic.findings), "{:?}", quadratic.findings);
    close(quadratic.model.actuator.thrust_coefficient, THRUST, 1e-15);
    type Law<'a> = &'a dyn Fn(f64) -> f64;
    let added = with_thrust(&|rate| THRUST * rate * rate + 0.5);
    assert!(finding(&added, "thrust_not_quadratic").is_some_and(|it| it.number("linear_share") > 0.03));
    let turned = with_thrust(&|rate| -THRUST * rate * rate);
    assert!(finding(&turned, "thrust_falls_with_rate").is_some());
    for (thrust, unit) in [
        ((&|rate| 0.102 * THRUST * rate * rate) as Law, "kgf"),
        (&|rate| 0.2248 * THRUST * rate * rate, "lbf"),
        (&|rate| 3.597 * THRUST * rate * rate, "ozf"),
    ] {
        let found = with_thrust(thrust);
        let asked = finding(&found, "thrust_unlike_template").map(|it| it.text("unit"));
        assert_eq!(asked, Some(unit), "{:?}", found.findings);
    }
    // No propeller pushes so hard at these rates: nothing is fitted to it.
    let grams = screened(&[log_with(&|rate| 101.97 * THRUST * rate * rate)]);
    match identify(&grams, &[], &IdentifySettings::default()) {
        Err(IdentifyError::Screening(ScreeningError::Column(asked))) => {
            assert_eq!((asked.code, asked.text("unit")), ("thrust_unlike_template", "gf"));
        }
        other => panic!("{other:?}"),
    }
    // Another propeller's.
    assert!(!speaks_of_thrust(&with_thrust(&|rate| 0.4 * THRUST * rate * rate).findings));
    // A model with such a c is none that anything takes.
    let falling = with_thrust(&|rate| -THRUST * rate * rate);
    assert!(falling.thrust.is_none());
    close(falling.model.actuator.thrust_coefficient, THRUST, 3.2e-5 * THRUST);
}

/// The log with some of its columns only.
fn only(log: &Dataset, names: &[&str]) -> Dataset {
    let mut kept = Dataset::new("attitude.csv", "", log.time().to_vec()).expect("rising time");
    for name in names {
        let column = log.column(name).expect("there").to_vec();
        kept.insert(*name, column).expect("as long as time");
    }
    kept
}

#[test]
fn eqs_1_and_12_the_inertia_from_an_attitude_log() {
    let log = attitude(|t| 0.25 * (exciting(t) - 0.47), 3000);
    let rates = ["propeller_rate_1_rad_s", "propeller_rate_2_rad_s", "body_rate_rad_s"];
    let settings = |degree| IdentifySettings { degree, battery: false, ..IdentifySettings::default() };
    let inertia = |log: &Dataset| {
        let found =
            identify(&screened(std::slice::from_ref(log)), &[], &settings(Some(2))).expect("identified");
        let body = found.body.expect("the body turns");
        assert_eq!(found.model.body.inertia, body.inertia.value);
        close(body.inertia.value * body.arm_over_inertia.value, ARM, 1e-12);
        println!("J = {:?} from {}", body.inertia, body.driven_by);
        body
    };
    // With the commands the rotors are known between the samples, too.
    let body = inertia(&log);
    assert_eq!(body.driven_by, "measured_rotor_rates");
    // Between the samples the rotors are the exponentials of the free run; what is left is the run against the bench.
    close(body.inertia.value, INERTIA, 3e-5 * INERTIA);
    // Without them a straight line stands for an exponential: (p T_s)²/12 = 0.9 % of the fast part.
    close(inertia(&only(&log, &rates)).inertia.value, INERTIA, 0.01 * INERTIA);
    // A commanded torque is held from its row to the next.
    let mut held = Dataset::new("held.csv", "", log.time().to_vec()).expect("rising time");
    let torques: Vec<f64> = log.time().iter().map(|t| exciting(*t) - 0.47).collect();
    let mut rate = 0.0;
    let rates = torques.iter().map(|torque| {
        let before = rate;
        rate += PERIOD * torque / INERTIA;
        before
    });
    held.insert("body_rate_rad_s", rates.collect()).expect("as long as time");
    held.insert("torque_command_nm", torques).expect("as long as time");
    let body = inertia(&held);
    assert_eq!(body.driven_by, "torque_command");
    close(body.inertia.value, INERTIA, 1e-9);
    // The template's rotor, from the commands alone: the paper's, as here.
    let body = inertia(&only(&log, &["command_1", "command_2", "body_rate_rad_s"]));
    assert_eq!(body.driven_by, "predicted_rotor_rates");
    close(body.inertia.value, INERTIA, 1e-3 * INERTIA);
}

#[test]
fn eq_12_has_a_sign_and_a_body_that_does_not_turn_has_no_inertia() {
    let log = attitude(|t| 0.25 * (exciting(t) - 0.47), 3000);
    let with_rate = |change: &dyn Fn(f64) -> f64| {
        let mut log = log.clone();
        let rates = log.column("body_rate_rad_s").expect("there").iter().map(|rate| change(*rate)).collect();
        log.replace("body_rate_rad_s", rates).expect("as long as before");
        identify(&screened(&[log]), &[], &IdentifySettings { degree: Some(2), ..IdentifySettings::default() })
            .expect("the rotors are identified all the same")
    };
    // Not moved, and not frozen either: the last digits of a reading that answers nothing.
    let still = |rate: f64| 0.001 + 1e-5 * f64::from((rate.to_bits() % 251) as u8);
    let turned = |rate: f64| -rate;
    for (change, code) in
        [(&turned as &dyn Fn(f64) -> f64, "torque_hardly_shows"), (&still, "body_held_still")]
    {
        let found = with_rate(change);
        assert!(found.body.is_none());
        let hardly = finding(&found, code).expect("it does");
        assert!(!sentence(hardly).contains("0.000 ±"), "{}", sentence(hardly));
        assert_eq!(found.model.body.inertia, 0.032, "the template's");
    }
}
