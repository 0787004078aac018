//! All commands that read a log take the same rows of it for measurements.

use rotorbench::compare::{CompareConfig, compare};
use rotorbench::diagnose::{DiagnoseConfig, diagnose, extend};
use rotorbench::identify::{IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::model::Model;
use rotorbench::screening::summary::LogSummary;
use rotorbench::screening::{Finding, ScreenedLog};

use super::bench::{bench, prbs, run};

const RATE: &str = "propeller_rate_1_rad_s";

/// A rotor's log in which telemetry drops out, freezes and jumps, and the battery is not read for a moment.
fn damaged(seed: u64, name: &str) -> Dataset {
    let mut log = run(&bench(seed), prbs(60.0, seed), name);
    let rates = log.column(RATE).expect("measured").to_vec();
    let damage = |row: usize| match row {
        400 | 900..902 => 0.0,
        1200 => 5000.0,
        1600..1700 => rates[1600],
        _ => rates[row],
    };
    let rows = log.len();
    log.replace(RATE, (0..rows).map(damage).collect()).expect("as long");
    let volts = log.column("battery_voltage_v").expect("measured").iter().enumerate();
    let volts = volts.map(|(row, volts)| if row == 777 { 0.0 } else { *volts }).collect();
    log.replace("battery_voltage_v", volts).expect("as long");
    log
}

#[test]
fn identify_compare_diagnose_extend_and_import_leave_out_the_same_rows() {
    let logs = [damaged(31, "train.csv"), damaged(32, "validate.csv")];
    let (train, validate) = (&logs[..1], &logs[1..]);
    let screened = ScreenedLog::of(&logs[0]);
    let expected: Vec<Finding> = screened.findings().cloned().collect();
    let codes: Vec<&str> = expected.iter().map(|it| it.code).collect();
    assert_eq!(codes, ["battery_dropout", "rate_dropout", "rate_frozen", "outliers"]);
    let channel = screened.channel(RATE).expect("it is looked at");
    assert_eq!(channel.left_out().count(), 3 + 100 + 1);
    assert_eq!([400, 1200, 1650].map(|row| channel.reason(row)), [1, 3, 2].map(|at| Some(codes[at])));
    // Each finding carries its rows and where the first of them is: the same findings are the same rows.
    let of_the_log = |findings: &[Finding]| -> Vec<Finding> {
        let of_cells = findings.iter().filter(|it| it.log == "train.csv" && codes.contains(&it.code));
        of_cells.cloned().collect()
    };
    let model = Model::paper();
    let identified = identify(train, validate, &IdentifySettings::default()).expect("identified");
    assert_eq!(of_the_log(&identified.findings), expected, "identify");
    let compared =
        compare(std::slice::from_ref(&model), &logs[0], &CompareConfig::default()).expect("compared");
    assert_eq!(of_the_log(&compared[0].findings), expected, "compare");
    let rotor = compared[0].blocks.iter().find(|block| block.name == "actuator_1").expect("judged");
    // Its trace has every row; what is not measured is not-a-number.
    let readings = rotor.trace.rows.iter().zip(&rotor.trace.measured);
    assert!(readings.clone().all(|(row, rate)| channel.reason(*row).is_none() || rate.is_nan()));
    assert!(readings.filter(|(_, rate)| rate.is_finite()).count() > 2000);
    let config = DiagnoseConfig::default();
    let diagnosed = diagnose(&model, train, validate, &config, &|_| ()).expect("diagnosed");
    let mut found = of_the_log(&diagnosed.findings);
    found.sort_by_key(|finding| expected.iter().position(|it| it == finding));
    assert_eq!(found, expected, "diagnose");
    let effect = ["transport_delay".to_owned()];
    let extended = extend(&model, &effect, train, validate, &config).expect("extended");
    assert_eq!(of_the_log(&extended.findings), expected, "extend");
    let mut imported = of_the_log(&LogSummary::of(&logs[0]).findings);
    imported.sort_by_key(|finding| expected.iter().position(|it| it == finding));
    assert_eq!(imported, expected, "import");
}
