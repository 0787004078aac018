//! All commands that read a log take the same rows of it for measurements, and score the same rows of its rotors.

use std::collections::BTreeMap;

use rotorbench::bench::BenchConfig;
use rotorbench::compare::{CompareConfig, ScoredBlock, compare};
use rotorbench::diagnose::block_builder::{Driver, body_split};
use rotorbench::diagnose::block_data::Runs;
use rotorbench::diagnose::rotor_block::rotor_runs;
use rotorbench::diagnose::{DiagnoseConfig, diagnose, extend};
use rotorbench::emulate::EmulatorConfig;
use rotorbench::experiment::{ExperimentConfig, Rotors, Waveform};
use rotorbench::identify::{IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::model::Model;
use rotorbench::runtime::ExperimentPlan;
use rotorbench::runtime::experiment::in_lockstep;
use rotorbench::screening::summary::LogSummary;
use rotorbench::screening::{Finding, ScreenedLog};

use super::bench::{bench, prbs, run};

const RATE: &str = "propeller_rate_1_rad_s";
const COMMAND: &str = "command_1";
const VOLTAGE: &str = "battery_voltage_v";

/// What the screening finds in [`damaged`], in the order in which it says it.
const CODES: [&str; 8] = [
    "battery_saturated",
    "rate_dropout",
    "rate_frozen",
    "outliers",
    "standstill_left_out",
    "uncommanded_motion",
    "commands_missing",
    "body_held_still",
];

/// A rotor's log, 50 Hz, with everything wrong that takes rows away: telemetry that drops out, freezes and jumps, a rotor that
/// is stopped for two seconds, commands that are missing in three rows, a recorder of commands that freezes for eight seconds,
/// a battery that is read no higher than 12.1 V, and a body that is clamped.
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
    let rows = block.trace.rows().iter().zip(block.trace.is_scored());
    let rows: Vec<usize> = rows.filter_map(|(row, is_scored)| is_scored.then_some(row)).collect();
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

const GYRO: &str = "body_rate_rad_s";
const ANGLE: &str = "body_angle_rad";

/// A bench's log, 50 Hz, its body free and turned by both rotors, with everything wrong that takes rows of body and thrust away: a
/// gyro that freezes and jumps, an angle that jumps and is not there, telemetry of either rotor that drops out for longer than a
/// line may bridge and shorter, commands that are missing, a load cell that is switched off, a second without a row.
fn damaged_bench(seed: u64, name: &str) -> Dataset {
    let mut emulator = EmulatorConfig { seed, ..EmulatorConfig::default() };
    emulator.sensors.thrust.rate_hz = 50.0;
    let shape = Waveform::Prbs { amplitude: 0.03, bandwidth_hz: 0.0, duration_s: 60.0, seed };
    let experiment = ExperimentConfig { shape, rotors: Rotors::Differential, around: 0.4633, lead_in_s: 4.0 };
    let plan = ExperimentPlan { closed_loop: true, experiment };
    let bench = BenchConfig { emulator, ..BenchConfig::default() };
    let (body, _) = in_lockstep(&bench, &plan, &mut (), |_| true).expect("an experiment that can be");
    let whole = body.into_dataset(name).expect("rising time");
    let (first, last) = (whole.slice(0..2400), whole.slice(2450..whole.len()));
    let both = |of: &dyn Fn(&Dataset) -> Vec<f64>| [of(&first), of(&last)].concat();
    let mut log = Dataset::new(name, "", both(&|part| part.time().to_vec())).expect("rising time");
    for column in whole.names() {
        let values =
            both(&|part| part.column(column).map_or_else(|| vec![f64::NAN; part.len()], <[f64]>::to_vec));
        let value = |row: usize| match (column, row) {
            (GYRO, 601..800) => values[600],
            (GYRO, 900) => 3.0,
            (ANGLE, 1000) => values[1000] + 0.5,
            (ANGLE, 1100..1105) => f64::NAN,
            ("propeller_rate_1_rad_s", 400..403) | ("propeller_rate_2_rad_s", 1300..1330) => f64::NAN,
            ("thrust_1_n", 1600..1650) | ("command_2", 1400..1403) => f64::NAN,
            _ => values[row],
        };
        log.insert(column, (0..values.len()).map(value).collect()).expect("as long");
    }
    log
}

/// Rows in which a channel of the body is scored, by the screening.
fn judged(log: &ScreenedLog, name: &str) -> Vec<usize> {
    let (values, why) = (log.dataset().column(name).expect("measured"), log.body_reasons(name));
    (0..values.len()).filter(|row| values[*row].is_finite() && why[*row].is_none()).collect()
}

/// Rows that a block of `compare` scores, and those that it looked at.
fn compared(block: &ScoredBlock) -> (Vec<usize>, Vec<usize>) {
    let rows = block.trace.rows().iter().zip(block.trace.is_scored());
    let scored = rows.filter_map(|(row, is_scored)| is_scored.then_some(row));
    (scored.collect(), block.trace.rows().iter().collect())
}

#[test]
fn all_of_them_score_the_same_rows_of_second_rotor_thrust_and_body() {
    let raw = damaged_bench(41, "bench.csv");
    let log = ScreenedLog::of(&raw);
    let logs = std::slice::from_ref(&log);
    let body = log.body().expect("a body");
    let codes: Vec<&str> = log.findings().map(|it| it.code).collect();
    for code in ["gyro_frozen", "outliers", "commands_missing"] {
        assert!(codes.contains(&code), "{codes:?}");
    }
    let (gyro, angle) = (judged(&log, GYRO), judged(&log, ANGLE));
    // The rows of a frozen gyro, an outlier, and those in which a rotor is not known; three rows of a rotor are.
    let why = log.body_reasons(GYRO);
    let reasons = [620, 900, 1310].map(|row| why[row].unwrap_or(""));
    assert_eq!(reasons, ["gyro_frozen", "outliers", "rotor_rate_missing"]);
    assert!([401, 1000, 1102, 1401].iter().all(|row| gyro.binary_search(row).is_ok()));
    assert_eq!([1000, 1102, 1310].map(|row| angle.binary_search(&row).is_ok()), [false; 3]);
    assert_eq!(body.stretches().len(), 3, "a gap and a hole: {:?}", body.stretches());
    let second: Vec<usize> = log.rotor(2).expect("a rotor").scored().collect();
    assert!(second.binary_search(&1401).is_err() && log.rotor(1).expect("a rotor").is_scored(1401));
    let has_thrust = |row: &usize| log.dataset().column("thrust_1_n").is_some_and(|it| it[*row].is_finite());
    let is_scored = |row: &usize| has_thrust(row) && log.thrust(1).expect("measured").reason(*row).is_none();
    let thrust: Vec<usize> = (0..raw.len()).filter(is_scored).collect();
    assert!([401, 1620].iter().all(|row| thrust.binary_search(row).is_err()) && thrust.len() > 2500);

    let settings = IdentifySettings { delay: false, ..IdentifySettings::default() };
    let identified = identify(logs, &[], &settings).expect("identified");
    let row_at = |time: f64| raw.time().iter().position(|it| *it == time).expect("a row");
    let fitted = identified.body.expect("the body turns");
    let rows: Vec<usize> = fitted.traces.iter().map(|(time, ..)| row_at(*time)).collect();
    // The rest of a stretch, of less than five readings, is no window.
    assert!(rows.iter().all(|row| gyro.binary_search(row).is_ok()), "identify");
    assert!(gyro.len() - rows.len() <= 4 * body.stretches().len() + 4, "{} of {}", rows.len(), gyro.len());
    let both = [1, 2].map(|number| {
        let cells = log.dataset().column(&format!("thrust_{number}_n")).expect("measured").iter().enumerate();
        let judged = log.thrust(number).expect("measured");
        cells.filter(|(row, it)| it.is_finite() && judged.reason(*row).is_none()).count()
    });
    assert_eq!(identified.thrust.expect("measured").samples, both[0] + both[1], "identify");

    let model = Model::paper();
    let found =
        compare(std::slice::from_ref(&model), &log, &CompareConfig::default()).expect("compared").remove(0);
    let block = |name: &str, signal: &str| {
        let mut blocks = found.blocks.iter();
        compared(blocks.find(|it| it.name == name && it.signal == signal).expect("judged"))
    };
    assert_eq!(block("actuator_2", "propeller_rate_2_rad_s").0, second, "compare");
    assert_eq!(block("thrust_1", "thrust_1_n").0, thrust, "compare");
    for (signal, judged) in [(GYRO, &gyro), (ANGLE, &angle)] {
        let (scored, seen) = block("body", signal);
        // The rows at which windows start are given, not asked for.
        let expected: Vec<usize> =
            judged.iter().filter(|row| seen.binary_search(row).is_ok()).copied().collect();
        assert_eq!(scored, expected, "compare {signal}");
        let starts = judged.len() - expected.len();
        assert!(starts < judged.len() / 15, "{starts} starts of {}", judged.len());
    }

    let counted = |number: usize| -> Vec<usize> {
        let runs = rotor_runs(logs).into_iter().filter(|run| run.rotor + 1 == number);
        let rows =
            runs.flat_map(|run| run.rows.zip(run.counts)).filter_map(|(row, counts)| counts.then_some(row));
        rows.collect()
    };
    assert_eq!(counted(2), second, "diagnose and extend");
    let equations = model.equations().expect("known");
    let driver = Driver { equations: &equations, fitted: None, split: None };
    let split = body_split(logs, &[], &driver, 0.4).expect("known").expect("a body");
    let Runs::Body(runs) = &split.train.runs else { panic!("a body") };
    let rows_of =
        |pick: fn(&rotorbench::diagnose::body_block::BodyRun) -> &rotorbench::log::Cells| -> Vec<usize> {
            let rows = runs.iter().flat_map(|run| run.rows.clone().zip(pick(run)));
            rows.filter_map(|(row, value)| value.is_finite().then_some(row)).collect()
        };
    assert_eq!(rows_of(|run| &run.rate), gyro, "diagnose and extend");
    assert_eq!(rows_of(|run| &run.angle), angle, "diagnose and extend");

    let imported = LogSummary::of(&log);
    let of_body = imported.body.expect("a body");
    assert_eq!((of_body.scored, of_body.scored_angles), (gyro.len(), angle.len()), "import");
    assert_eq!(
        (imported.rotors[1].scored, imported.thrusts[0].scored),
        (second.len(), thrust.len()),
        "import"
    );
    let said: usize = of_body.not_scored.values().sum();
    let empty = raw.column(GYRO).expect("measured").iter().filter(|it| !it.is_finite()).count();
    assert_eq!(gyro.len() + said + empty, raw.len(), "every row is scored, or says why not");
}
