//! What logs must be like before any model is held against them.

use super::checks::value_too_great::VALUE_TOO_GREAT;
use super::checks::{self, rows_are_levels};
use super::duplicate_logs::is_copy;
use super::suspicion::{Stops, Suspicion};
use super::telemetry_rate::too_seldom;
use super::{Finding, ScreenedLog, ScreenedRotor, ScreeningError};
use crate::log::Dataset;
use crate::log::signals::rotor_of;
use crate::model::Model;
use crate::signal::columns;
use crate::threads::spread;

/// What can hardly be what its name says in these logs, beside this model of their bench: of their columns, their bodies and these
/// rotors. What asks for a fit is not among it.
pub(crate) fn suspicions(logs: &[ScreenedLog], model: &Model, rotors: &[usize]) -> Vec<Suspicion> {
    let mut found = Vec::new();
    for log in logs {
        // A rotor that stood has nothing to say.
        let turning = log.rotors().filter(|it| it.turns() && rotors.contains(&it.number()));
        let turning: Vec<&ScreenedRotor> = turning.collect();
        let of_rotors = spread(&turning, |rotor| beside_model(rotor, model));
        let mut of_log: Vec<Suspicion> = of_rotors.into_iter().flatten().collect();
        of_log.extend(log.suspicions(rotors));
        // Rates in another unit make another torque of themselves.
        if of_log.iter().all(|it| it.stops == Stops::Nobody) {
            of_log.extend(checks::BODY_BESIDE_MODEL.iter().filter_map(|check| check(log, model)));
        }
        found.extend(of_log);
    }
    found
}

/// What these logs lack for this model: a battery's voltage, and rates of these rotors that come often enough to show how they follow.
pub(crate) fn lacking(logs: &[ScreenedLog], model: &Model, rotors: &[usize]) -> Vec<Finding> {
    let seldom = too_seldom(logs, rotors, model.actuator.pole);
    without_battery(model, logs).into_iter().chain(seldom).collect()
}

/// What a model can tell of a rotor; where its own columns cannot be what they are said to be, of its battery alone.
fn beside_model(rotor: &ScreenedRotor, model: &Model) -> Vec<Suspicion> {
    let of_rotor = if rotor.stops_fits() { &[][..] } else { checks::ROTOR_BESIDE_MODEL };
    let all = checks::BATTERY_BESIDE_MODEL.iter().chain(of_rotor);
    all.filter_map(|check| check(rotor.data(), model)).collect()
}

/// Refuses values whose squares are no numbers: nothing can be reckoned with them.
///
/// # Errors
/// [`ScreeningError::Column`] of the first.
pub fn check_magnitudes(log: &ScreenedLog) -> Result<(), ScreeningError> {
    let mut found = log.column_findings().filter(|it| it.code == VALUE_TOO_GREAT);
    found.next().map_or(Ok(()), |found| Err(ScreeningError::Column(Box::new(found.clone()))))
}

/// Refuses rows that are levels each: a free run goes from row to row, and nobody knows what was between them.
///
/// # Errors
/// [`ScreeningError::Column`] of the first rotor of which they are.
pub fn check_runs(log: &ScreenedLog) -> Result<(), ScreeningError> {
    let measured = log.rotors().filter(|rotor| rotor.turns() && rotor.is_measured());
    let mut found = measured.filter_map(|rotor| rows_are_levels::check(rotor.data()));
    found.next().map_or(Ok(()), |found| Err(ScreeningError::Column(Box::new(found.finding))))
}

/// Logs whose battery nobody measured, under a model that wants to know.
fn without_battery(model: &Model, logs: &[ScreenedLog]) -> Vec<Finding> {
    let drives =
        |log: &&Dataset| log.names().any(|name| rotor_of(name).is_some() && columns::is_command(name));
    let lacks = |log: &&Dataset| !log.has(columns::BATTERY_VOLTAGE);
    let wants = model.actuator.voltage_gain != 0.0 || model.needs(columns::BATTERY_VOLTAGE);
    let without = logs.iter().map(ScreenedLog::dataset).filter(|log| wants && drives(log) && lacks(log));
    without
        .map(|log| Finding::new("no_battery_voltage", columns::BATTERY_VOLTAGE).of(log.source_name()))
        .collect()
}

/// Logs that are there twice: what was fitted cannot judge the fit.
#[must_use]
pub fn repeated(train: &[ScreenedLog], validate: &[ScreenedLog]) -> Vec<Finding> {
    let of = |code, log: &ScreenedLog| Finding::new(code, "").of(log.source_name());
    let mut found = Vec::new();
    for (index, log) in train.iter().enumerate() {
        if train[..index].iter().any(|other| is_copy(log, other)) {
            found.push(of("log_given_twice", log));
        }
    }
    let judged = validate.iter().filter(|log| train.iter().any(|other| is_copy(log, other)));
    found.extend(judged.map(|log| of("log_fitted_and_validated", log)));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::screening::screened;

    fn log(name: &str, hash: &str, value: f64) -> Dataset {
        let mut log = Dataset::new(name, hash, vec![0.0, 1.0]).expect("time rises");
        log.insert("command_1", vec![0.5, value]).expect("fits");
        log
    }

    #[test]
    fn a_value_that_no_bench_measures_is_named_with_its_place() {
        let check = |value| check_magnitudes(&log("a.csv", "", value).into());
        assert_eq!(check(0.6), Ok(()));
        let Err(ScreeningError::Column(found)) = check(-1e160) else { panic!("absurd") };
        assert_eq!((found.log.as_str(), found.subject.as_str()), ("a.csv", "command_1"));
        assert_eq!(["value", "at_s"].map(|name| found.number(name)), [-1e160, 1.0]);
    }

    #[test]
    fn a_log_that_is_fitted_and_judged_is_found() {
        let one = screened(&[log("a.csv", "1", 0.6)]);
        let both = screened(&[log("a.csv", "1", 0.6), log("b.csv", "2", 0.6)]);
        assert!(repeated(&one, &both[1..]).is_empty());
        let found = &repeated(&both, &one)[0];
        assert_eq!((found.code, found.log.as_str()), ("log_fitted_and_validated", "a.csv"));
        assert_eq!(repeated(&[&one[..], &one[..]].concat(), &[])[0].code, "log_given_twice");
        let later = Dataset::new("a.csv", "1", vec![1.0, 2.0]).expect("time rises");
        assert!(repeated(&one, &[later.into()]).is_empty(), "another part of the same recording");
    }
}
