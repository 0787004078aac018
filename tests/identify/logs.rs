//! Logs that say nothing, or something else than their names.

use rotorbench::report::findings::sentences;
use std::f64::consts::TAU;
use std::process::Command;

use rotorbench::identify::{IdentifyError, IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::screening::{Finding, screened};
use rotorbench::shm::{PassingBench, SharedMemoryConfig};

use super::bench::{bench, prbs, run};

/// A bench with twice the battery of the paper's: its own voltage is full, whether or not the battery is asked for.
#[test]
fn a_battery_that_has_more_than_the_template_is_full_at_its_own_voltage() {
    let mut log = run(&bench(5), prbs(60.0, 5), "doubled");
    let volts: Vec<f64> =
        log.column("battery_voltage_v").expect("measured").iter().map(|v| 2.0 * v).collect();
    let best = volts.iter().copied().filter(|volts| volts.is_finite()).fold(0.0, f64::max);
    log.replace("battery_voltage_v", volts).expect("fits");
    for battery in [true, false] {
        let settings = IdentifySettings { battery, degree: Some(2), ..IdentifySettings::default() };
        let found = identify(&screened(std::slice::from_ref(&log)), &[], &settings).expect("identified");
        let full = found.model.actuator.full_voltage;
        // A hundredth of the readings may be glitches, and it is said to a tenth of a volt.
        assert!((best - 0.3..=best + 0.05).contains(&full), "{full} V of at most {best}");
        let above = found.findings.iter().any(|it| it.code == "battery_above_full_voltage");
        assert!(above, "{:?}", found.findings);
    }
}

/// Logs that say nothing, or something else than their names, beside a good one and alone.
#[test]
fn logs_that_cannot_be_used_are_named_with_the_reason() {
    let good = run(&bench(3), prbs(60.0, 3), "good.csv");
    let settings = || IdentifySettings { degree: Some(2), ..IdentifySettings::default() };
    let both = |bad: &Dataset| {
        let found =
            identify(&screened(&[good.clone(), bad.clone()]), &[], &settings()).expect("the good one");
        let alone = identify(&screened(std::slice::from_ref(bad)), &[], &settings());
        let Err(IdentifyError::Nothing { reasons, .. }) = alone else { panic!("{alone:?}") };
        (found.findings, reasons)
    };
    let renamed = |name: &str| Dataset::new(name, "", good.time().to_vec()).expect("rising time");
    let column = |name: &str| good.column(name).expect("there").to_vec();
    let mut five = Dataset::new("five.csv", "", good.time()[..5].to_vec()).expect("rising time");
    let mut header = Dataset::new("header.csv", "", vec![]).expect("no time goes back");
    let mut rpm = renamed("rpm.csv");
    let mut frozen = renamed("frozen.csv");
    let mut bare = renamed("bare.csv");
    for name in ["command_1", "battery_voltage_v", "propeller_rate_1_rad_s"] {
        five.insert(name, column(name)[..5].to_vec()).expect("five");
        header.insert(name, vec![]).expect("none");
        rpm.insert(name.replace("rad_s", "rpm"), column(name)).expect("fits");
        frozen.insert(name, column(name)).expect("fits");
        bare.insert(name.replace("_rad_s", ""), column(name)).expect("fits");
    }
    frozen.replace("command_1", vec![0.4633; good.len()]).expect("fits");
    let without_rotor = vec![
        ("log_not_used", "", "no_rotor_columns"),
        ("column_in_another_unit", "propeller_rate_1_rpm", ""),
    ];
    let motionless =
        vec![("uncommanded_motion", "rotor 1", ""), ("log_not_used", "", "no_rate_under_command")];
    let wrong = [
        (&five, vec![("log_not_used", "", "not_excited")]),
        (&header, vec![("log_not_used", "", "no_rows")]),
        (&rpm, without_rotor),
        (&bare, vec![("column_without_unit", "propeller_rate_1", "")]),
        (&frozen, motionless),
    ];
    for (bad, expected) in wrong {
        let (beside, alone) = both(bad);
        for (code, subject, reason) in expected {
            let is_it = |it: &Finding| {
                let place = (it.code, it.log.as_str(), it.subject.as_str());
                place == (code, bad.source_name(), subject) && it.text("reason") == reason
            };
            assert!(beside.iter().any(is_it), "{code} {reason}: {beside:?}");
            assert!(alone.iter().any(is_it), "{code} {reason}: {alone:?}");
        }
    }
    // What is good alone is as good beside them: the same numbers.
    let (alone, beside) = (
        identify(&screened(std::slice::from_ref(&good)), &[], &settings()),
        [good.clone(), five, header, frozen],
    );
    let beside = identify(&screened(&beside), &[], &settings()).expect("identified");
    assert_eq!(alone.expect("identified").model.actuator, beside.model.actuator);
    // Twice the same log says no more than once.
    let copy = |name: &str| {
        let mut copy = Dataset::new(name, "the same hash", good.time().to_vec()).expect("rising time");
        ["command_1", "battery_voltage_v", "propeller_rate_1_rad_s"]
            .into_iter()
            .for_each(|name| copy.insert(name, column(name)).expect("fits"));
        copy
    };
    let twice =
        identify(&screened(&[copy("a.csv"), copy("b.csv")]), &screened(&[copy("c.csv")]), &settings())
            .expect("identified");
    let once = identify(&screened(&[copy("a.csv")]), &[], &settings()).expect("identified");
    assert_eq!(twice.joint.map(|fit| fit.pole), once.joint.map(|fit| fit.pole));
    assert!(twice.validation.is_empty(), "{:?}", twice.validation.len());
    for (log, code) in [("b.csv", "log_not_used"), ("c.csv", "validation_log_was_fitted")] {
        let is_it = |it: &Finding| it.log == log && it.code == code && it.text("same_as") == "a.csv";
        assert!(twice.findings.iter().any(is_it), "{:?}", twice.findings);
    }
}

/// Values that are possible and hardly meant: said, with what they suggest, and not refused.
#[test]
fn values_that_suggest_another_unit_or_no_sensor_are_said() {
    let good = run(&bench(4), prbs(60.0, 4), "log.csv");
    let settings = |battery| IdentifySettings { degree: Some(2), battery, ..IdentifySettings::default() };
    let with = |name: &str, change: &dyn Fn(f64) -> f64| {
        let mut log = good.clone();
        log.replace(name, good.column(name).expect("there").iter().copied().map(change).collect())
            .expect("fits");
        identify(&screened(&[log]), &[], &settings(true)).expect("identified")
    };
    let none = identify(&screened(std::slice::from_ref(&good)), &[], &settings(false)).expect("identified");
    let dead = with("battery_voltage_v", &|_| 0.0);
    assert_eq!(dead.model.actuator, none.model.actuator, "as if no voltage had been measured");
    assert!(dead.findings.iter().any(|it| it.code == "battery_not_connected"), "{:?}", dead.findings);
    // Between the levels the rates are on their way: it is no one factor, and no unit for sure.
    for (factor, unit) in [(1.0 / TAU, "rev/s"), (0.06 / TAU, "krpm"), (5.7, "rpm")] {
        let found = with("propeller_rate_1_rad_s", &|rate| factor * rate);
        let is_it = |it: &Finding| it.code == "rate_unlike_template" && it.text("unit") == unit;
        let said = found.findings.iter().any(is_it);
        assert!(said, "{unit}: {:?}", sentences(&found.findings));
    }
    let known = with("propeller_rate_1_rad_s", &|rate| 1.5 * rate);
    let asks = |it: &Finding| ["rate_in_other_unit", "rate_unlike_template"].contains(&it.code);
    assert!(!known.findings.iter().any(asks), "{:?}", sentences(&known.findings));
}

#[test]
fn an_experiment_on_a_bench_that_nobody_guards_says_so_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = folder.path().join("bench.toml");
    let name = format!("nobody-{}", std::process::id());
    let _gone_with_the_test = PassingBench::open(&name, &SharedMemoryConfig::default()).expect("a bench");
    std::fs::write(&config, format!("name = \"{name}\"\n")).expect("written");
    let output = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args(["experiment", "ramp", "--output"])
        .arg(folder.path().join("ramp.csv"))
        .arg("--config")
        .arg(&config)
        .output()
        .expect("the program starts");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("is not running"), "{text}");
    let left = std::fs::read_dir(folder.path()).expect("readable").count();
    assert_eq!(left, 1, "neither a log nor a recording");
}
