//! All commands that read a log take the same rows of it for measurements, and score the same rows of its rotors.

use std::collections::BTreeMap;

use rotorbench::compare::{CompareConfig, compare};
use rotorbench::diagnose::rotor_block::rotor_runs;
use rotorbench::diagnose::{DiagnoseConfig, diagnose, extend};
use rotorbench::identify::{IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::model::Model;
use rotorbench::screening::summary::LogSummary;
use rotorbench::screening::{Finding, ScreenedLog};

use super::bench::{bench, prbs, run};

const RATE: &str = "propeller_rate_1_rad_s";
const COMMAND: &str = "command_1";
const VOLTAGE: &str = "battery_voltage_v";

/// What the screening finds in [`damaged`], in the order in which it says it.
const CODES: [&str; 7] = [
    "battery_saturated",
    "rate_dropout",
    "rate_frozen",
    "outliers",
    "standstill_left_out",
    "uncommanded_motion",
    "commands_missing",
];

/// A rotor's log, 50 Hz, with everything wrong that takes rows away: telemetry that drops out, freezes and jumps, a rotor that
/// is stopped for two seconds, commands that are missing in three rows, a recorder of commands that freezes for eight seconds,
/// a battery that is read no higher than 12.1 V.
fn damaged(seed: u64, name: &str) -> Dataset {
    let mut log = run(&bench(seed), prbs(60.0, seed), name);
    let (rates, commands) = (log.column(RATE).expect("measured"), log.column(COMMAND).expect("commanded"));
    let answer = |row: usize, from: usize| (-0.32 * (row - from) as f64).exp();
    let rate = |row: usize| match row {
        400 | 900..902 => 0.0,
        1200 => 5000.0,
        1600..1700 => rates[1600],
        2000..2100 => rates[2000] * answer(row, 2000),
        2100..2150 => rates[row] * (1.0 - answer(row, 2100)),
        _ => rates[row],
    };
    let command = |row: usize| match row {
        1400..1403 => f64::NAN,
        2000..2100 => 0.0,
        2500..2900 => commands[2500],
        _ => commands[row],
    };
    let volts = |row: usize| {
        let noise = (row.wrapping_mul(2_654_435_761) >> 9 & 255) as f64 / 255.0;
        (12.0 + 0.2 * (0.01 * row as f64).sin() + 0.05 * noise).min(12.1)
    };
    let rows = 0..log.len();
    let columns = [
        (RATE, rows.clone().map(rate).collect::<Vec<f64>>()),
        (COMMAND, rows.clone().map(command).collect()),
        (VOLTAGE, rows.map(volts).collect()),
    ];
    columns.into_iter().for_each(|(name, values)| log.replace(name, values).expect("as long"));
    log
}

#[test]
fn identify_compare_diagnose_extend_and_import_score_the_same_rows() {
    let [raw, other] = [damaged(31, "train.csv"), damaged(32, "validate.csv")];
    let logs = [ScreenedLog::of(&raw), ScreenedLog::of(&other)];
    let (train, validate) = (&logs[..1], &logs[1..]);
    let expected: Vec<Finding> = train[0].findings().cloned().collect();
    assert_eq!(expected.iter().map(|it| it.code).collect::<Vec<_>>(), CODES);
    let rotor = train[0].rotor(1).expect("a rotor");
    let scored: Vec<usize> = rotor.scored().collect();
    let why = |rows: [usize; 7]| rows.map(|row| (rotor.is_scored(row), rotor.reason(row).unwrap_or("")));
    // Of each kind a row; a row behind the stop is still a start, and the first row without a command still answers to the last.
    let rows = [400, 1200, 1650, 1401, 2050, 2124, 2700];
    let reasons = [
        "rate_dropout",
        "outliers",
        "rate_frozen",
        "commands_missing",
        "standstill_left_out",
        "standstill_left_out",
        "uncommanded_motion",
    ];
    assert_eq!(why(rows), reasons.map(|reason| (false, reason)));
    assert!([399, 1400, 1403, 1700, 2126, 2950].iter().all(|row| rotor.is_scored(*row)));
    assert!((2200..2600).contains(&scored.len()), "{}", scored.len());
    // Standing still is a measurement, and no evidence on the rotor's law.
    assert!(train[0].dataset().column(RATE).expect("measured")[2050].is_finite());
    assert!(train[0].dataset().column(VOLTAGE).is_none(), "what the battery had is not known");

    let of_the_log = |findings: &[Finding]| -> Vec<Finding> {
        let own = |it: &&Finding| it.log == "train.csv" && CODES.contains(&it.code);
        let mut found: Vec<Finding> = findings.iter().filter(own).cloned().collect();
        found.sort_by_key(|finding| expected.iter().position(|it| it == finding));
        found
    };
    let model = Model::paper();
    // Behind a delay the first rows of each stretch would not be looked at.
    let settings = IdentifySettings { delay: false, ..IdentifySettings::default() };
    let identified = identify(train, validate, &settings).expect("identified");
    assert_eq!(of_the_log(&identified.findings), expected, "identify");
    let row_at = |time: f64| raw.time().iter().position(|it| *it == time);
    let traces = identified.training[0].traces.iter().filter(|(_, rate, _)| rate.is_finite());
    assert_eq!(traces.filter_map(|(time, ..)| row_at(*time)).collect::<Vec<_>>(), scored, "identify");

    let compared = compare(std::slice::from_ref(&model), &logs[0], &CompareConfig::default());
    let compared = compared.expect("compared").remove(0);
    assert_eq!(of_the_log(&compared.findings), expected, "compare");
    let block = compared.blocks.iter().find(|block| block.name == "actuator_1").expect("judged");
    let rows = block.trace.rows.iter().zip(&block.trace.is_scored);
    let rows: Vec<usize> = rows.filter_map(|(row, is_scored)| is_scored.then_some(*row)).collect();
    assert_eq!((rows, block.samples), (scored.clone(), scored.len()), "compare");

    let config = DiagnoseConfig::default();
    let diagnosed = diagnose(&model, train, validate, &config, &|_| ()).expect("diagnosed");
    assert_eq!(of_the_log(&diagnosed.findings), expected, "diagnose");
    let effect = ["transport_delay".to_owned()];
    let extended = extend(&model, &effect, train, validate, &config).expect("extended");
    assert_eq!(of_the_log(&extended.findings), expected, "extend");
    // Both make their rotor block of these.
    let runs = rotor_runs(train);
    let counted = runs.iter().flat_map(|run| run.rows.clone().zip(&run.counts));
    let counted: Vec<usize> = counted.filter_map(|(row, counts)| counts.then_some(row)).collect();
    assert_eq!(counted, scored, "diagnose and extend");

    let imported = LogSummary::of(&train[0]);
    assert_eq!(of_the_log(&imported.findings), expected, "import");
    let mut reasons = BTreeMap::new();
    (0..raw.len()).filter_map(|row| rotor.reason(row)).for_each(|why| *reasons.entry(why).or_insert(0) += 1);
    assert_eq!(
        (imported.rotors[0].scored, &imported.rotors[0].not_scored),
        (scored.len(), &reasons),
        "import"
    );
    assert_eq!(
        scored.len() + reasons.values().sum::<usize>(),
        raw.len(),
        "every row is scored, or says why not"
    );
}
