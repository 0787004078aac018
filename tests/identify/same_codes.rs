//! All commands that read a log say the same of it: of what is damaged the same code, refused or said; of what is right nothing.

use std::f64::consts::{PI, TAU};

use rotorbench::bench::BenchConfig;
use rotorbench::cancel::Cancel;
use rotorbench::compare::{CompareConfig, CompareError};
use rotorbench::diagnose::{DiagnoseConfig, DiagnoseError};
use rotorbench::emulate::EmulatorConfig;
use rotorbench::experiment::{ExperimentConfig, Rotors, Waveform};
use rotorbench::identify::{IdentifyError, IdentifySettings};
use rotorbench::log::Dataset;
use rotorbench::model::Model;
use rotorbench::runtime::ExperimentPlan;
use rotorbench::runtime::experiment::in_lockstep;
use rotorbench::screening::{Finding, ScreenedLog, ScreeningError};
use rotorbench::session::{self, Job, SessionError};

const RPM: f64 = 30.0 / PI;
const DEGREES: f64 = 180.0 / PI;

/// What one log is asked about: codes of columns that can hardly be what their names say, and of what else is missing for a model.
/// What a command says of its own answer is its own.
const CODES: [&str; 29] = [
    "value_too_great",
    "column_without_unit",
    "column_of_no_signal",
    "column_in_another_unit",
    "samples_too_far_apart",
    "readings_too_seldom",
    "command_out_of_range",
    "command_saturated",
    "rate_too_fast",
    "rate_in_other_unit",
    "rate_unlike_template",
    "thrust_unlike_template",
    "rate_negative",
    "rate_falls_with_command",
    "rotor_does_not_turn",
    "rotor_too_slow",
    "rates_of_other_rotor",
    "rates_lead_commands",
    "battery_voltage_too_high",
    "battery_in_other_unit",
    "battery_of_other_bench",
    "battery_reading_frozen",
    "no_battery_voltage",
    "time_in_milliseconds",
    "body_rate_in_degrees",
    "body_rate_too_fast",
    "body_angle_in_degrees",
    "body_turns_over",
    "torque_scale",
];

/// 40 s of the emulated bench under its controller, 50 Hz, its body free.
fn right() -> Dataset {
    let mut emulator = EmulatorConfig { seed: 61, ..EmulatorConfig::default() };
    emulator.sensors.thrust.rate_hz = 50.0;
    let shape = Waveform::Prbs { amplitude: 0.03, bandwidth_hz: 0.0, duration_s: 40.0, seed: 61 };
    let experiment = ExperimentConfig { shape, rotors: Rotors::Differential, around: 0.4633, lead_in_s: 4.0 };
    let plan = ExperimentPlan { closed_loop: true, experiment };
    let bench = BenchConfig { emulator, ..BenchConfig::default() };
    let (log, _) = in_lockstep(&bench, &plan, &mut (), |_| true).expect("an experiment that can be");
    log.into_dataset("right.csv").expect("rising time")
}

/// The log with each value of the columns that begin with `stem` through `change`; `time` is a column, too.
fn changed(log: &Dataset, stem: &str, change: impl Fn(usize, f64) -> f64) -> Dataset {
    let values = |name: &str, values: &[f64]| -> Vec<f64> {
        let is_it = name.starts_with(stem);
        values.iter().enumerate().map(|(row, it)| if is_it { change(row, *it) } else { *it }).collect()
    };
    let mut out = Dataset::new("log.csv", "", values("time", log.time())).expect("rising time");
    for name in log.names() {
        out.insert(name, values(name, log.column(name).unwrap_or(&[]))).expect("as long as time");
    }
    out
}

/// What a command said of a log: its codes, or the one for which it refused it.
#[derive(Debug, PartialEq)]
enum Said {
    Codes(Vec<&'static str>),
    Refused(&'static str),
}

fn codes<'a>(findings: impl IntoIterator<Item = &'a Finding>) -> Said {
    let mut codes: Vec<&str> =
        findings.into_iter().map(|it| it.code).filter(|it| CODES.contains(it)).collect();
    codes.sort_unstable();
    codes.dedup();
    Said::Codes(codes)
}

fn refused(error: &SessionError) -> Said {
    let column = match error {
        SessionError::Identify(IdentifyError::Screening(error))
        | SessionError::Compare(CompareError::Screening(error))
        | SessionError::Diagnose(DiagnoseError::Screening(error)) => error,
        // Nothing is excited, or there is too little of it: what is said of its columns stands in the reasons.
        SessionError::Identify(IdentifyError::Nothing { reasons, .. }) => return codes(reasons),
        other => panic!("{other}"),
    };
    match column {
        ScreeningError::Column(finding) => Said::Refused(finding.code),
        ScreeningError::NothingScored { reasons, .. } => {
            Said::Codes(reasons.iter().copied().filter(|it| CODES.contains(it)).collect())
        }
        other => panic!("{other}"),
    }
}

/// What `import`, `compare`, `identify`, `diagnose` and `extend` say of a log beside the paper's model.
fn asked(log: Dataset) -> [Said; 5] {
    let (cancel, model) = (Cancel::default(), Model::paper());
    let job = Job::unwatched(&cancel);
    let logs = [ScreenedLog::from(log)];
    let import = session::summarize(&logs[0], &model, &job);
    let config = CompareConfig { signals: false, ..CompareConfig::default() };
    let compare = session::compare(std::slice::from_ref(&model), &logs, &config, &job);
    let of_compare = |found: &Vec<Vec<rotorbench::compare::Comparison>>| {
        codes(found.iter().flatten().flat_map(|it| it.findings.iter().chain(&it.mistaken_columns)))
    };
    let identify = session::identify(&logs, &[], &IdentifySettings::default(), &job);
    let config = DiagnoseConfig::default();
    let diagnose = session::diagnose(&model, &logs, &[], &config, &job);
    let extend = session::extend(&model, &["torque_bias".to_owned()], (&logs, &[]), &config, &job);
    [
        import.as_ref().map_or_else(refused, |found| codes(&found.findings)),
        compare.as_ref().map_or_else(refused, of_compare),
        identify.as_ref().map_or_else(refused, |found| codes(&found.findings)),
        diagnose.as_ref().map_or_else(refused, |found| codes(&found.findings)),
        extend.as_ref().map_or_else(refused, |found| codes(&found.findings)),
    ]
}

/// Asks all of them; `code` is said by who does not refuse it, and `stops` counts who does, from the last one on.
fn expect(log: Dataset, code: &'static str, stops: usize) {
    let said = asked(log);
    let Said::Codes(all) = &said[0] else { panic!("import refused {code}: {said:?}") };
    assert!(all.contains(&code), "{code}: {said:?}");
    for (at, said_here) in said.iter().enumerate() {
        let expected = if at < 5 - stops { Said::Codes(all.clone()) } else { Said::Refused(code) };
        assert_eq!(*said_here, expected, "{code}, command {at}: {said:?}");
    }
}

#[test]
fn of_a_log_that_is_right_nothing_is_said_and_nothing_refused() {
    for said in asked(right()) {
        assert_eq!(said, Said::Codes(Vec::new()));
    }
}

/// Whatever is fitted to such a column would be taken for physics.
#[test]
fn what_nothing_can_be_fitted_to_is_refused_by_all_that_fit() {
    let log = right();
    expect(changed(&log, "propeller_rate", |_, rate| DEGREES * rate), "rate_too_fast", 3);
    expect(changed(&log, "propeller_rate", |_, rate| -rate), "rate_negative", 3);
    expect(changed(&log, "command", |_, command| 1000.0 * command), "command_out_of_range", 3);
    expect(changed(&log, "command", |_, command| 1000.0 + 1000.0 * command), "command_out_of_range", 3);
    expect(changed(&log, "command", |_, command| 1.0 - command), "rate_falls_with_command", 3);
    expect(changed(&log, "battery", |_, volts| 1000.0 * volts), "battery_in_other_unit", 3);
    expect(changed(&log, "battery", |_, volts| 10.0 * volts), "battery_in_other_unit", 3);
    // Twice the model's battery, in tenths of a volt.
    expect(changed(&log, "battery", |_, volts| 20.0 * volts), "battery_in_other_unit", 3);
    expect(changed(&log, "thrust", |_, thrust| 101.97 * thrust), "thrust_unlike_template", 3);
    expect(changed(&log, "time", |_, time| 1000.0 * time), "samples_too_far_apart", 3);
    // No comparison reckons with it either.
    expect(
        changed(&log, "propeller_rate", |row, rate| if row == 0 { 1e160 } else { rate }),
        "value_too_great",
        4,
    );
}

/// It may be another bench's, of which `identify` makes a model; who searches with this model would take the unit for physics.
#[test]
fn what_cannot_be_of_the_models_bench_is_refused_by_who_searches_with_it() {
    let log = right();
    expect(changed(&log, "propeller_rate", |_, rate| RPM * rate), "rate_in_other_unit", 2);
    // A small propeller pushes as hard in N as the model's in kgf.
    expect(changed(&log, "thrust", |_, thrust| 0.10197 * thrust), "thrust_unlike_template", 2);
    // As of a body that is ten times as heavy.
    expect(changed(&log, "body_", |_, motion| 0.1 * motion), "torque_scale", 2);
}

/// `tools/test --all` runs them.
mod at_length {
    use super::*;

    #[test]
    fn further_units_that_are_not_the_models_are_refused_by_who_searches_with_it() {
        let log = right();
        expect(changed(&log, "propeller_rate", |_, rate| rate / TAU), "rate_in_other_unit", 2);
        expect(changed(&log, "body_rate", |_, rate| DEGREES * rate), "body_rate_in_degrees", 2);
        expect(changed(&log, "body_angle", |_, angle| DEGREES * angle), "body_angle_in_degrees", 2);
    }

    #[test]
    fn what_is_in_doubt_is_said_by_all() {
        let log = right();
        expect(changed(&log, "propeller_rate", |_, rate| 5.7 * rate), "rate_unlike_template", 0);
        expect(changed(&log, "battery", |_, volts| 1.3 * volts), "battery_of_other_bench", 0);
        let fuller = [ScreenedLog::from(changed(&log, "battery", |_, volts| 1.3 * volts))];
        let cancel = Cancel::default();
        let found = session::identify(&fuller, &[], &IdentifySettings::default(), &Job::unwatched(&cancel));
        let said = found.expect("a rotor").warnings().join("\n");
        assert!(
            said.contains("is taken as full") && !said.contains("`rotorbench identify` makes a model"),
            "{said}"
        );
        expect(log.with_columns(|name| !name.starts_with("battery")), "no_battery_voltage", 0);
    }

    #[test]
    fn what_is_in_doubt_of_thrust_and_of_a_frozen_reading_is_said_by_all() {
        let log = right();
        expect(changed(&log, "thrust", |_, thrust| 20.0 * thrust), "thrust_unlike_template", 0);
        let frozen = log.column("battery_voltage_v").expect("measured")[200];
        expect(
            changed(&log, "battery", |row, volts| if row > 200 { frozen } else { volts }),
            "battery_reading_frozen",
            0,
        );
    }
}

/// A body alone, its rows three seconds apart: nothing shows how it moves.
#[test]
fn a_body_that_is_sampled_too_seldom_is_refused_by_all_that_fit() {
    let log = right();
    let rows: Vec<usize> = (0..log.len()).step_by(30).collect();
    let time: Vec<f64> = rows.iter().map(|row| 5.0 * log.time()[*row]).collect();
    let mut seldom = Dataset::new("log.csv", "", time).expect("rising time");
    for name in ["propeller_rate_1_rad_s", "propeller_rate_2_rad_s", "body_rate_rad_s", "body_angle_rad"] {
        let values = log.column(name).expect("measured");
        seldom.insert(name, rows.iter().map(|row| values[*row]).collect()).expect("as long");
    }
    let said = asked(seldom);
    let refused = Said::Refused("samples_too_far_apart");
    assert_eq!((&said[2], &said[3], &said[4]), (&refused, &refused, &refused), "{said:?}");
    assert_eq!(said[0], Said::Codes(vec!["samples_too_far_apart"]), "{said:?}");
}
