//! What logs must be like before any model is held against them.

use super::duplicate_logs::is_copy;
use super::thresholds::THRESHOLDS;
use super::{Finding, ScreenedLog, ScreeningError};
use crate::log::Dataset;
use crate::log::signals::rotor_of;
use crate::model::Model;
use crate::signal::columns;

/// Refuses values whose squares are no numbers.
///
/// # Errors
/// [`ScreeningError::Magnitude`] names the first.
pub fn check_magnitudes(log: &Dataset) -> Result<(), ScreeningError> {
    for column in log.names() {
        let values = log.column(column).unwrap_or(&[]);
        if let Some(row) = values.iter().position(|value| value.abs() > THRESHOLDS.greatest_value) {
            let (name, time) = (log.source_name().to_owned(), log.time()[row]);
            return Err(ScreeningError::Magnitude {
                log: name,
                column: column.to_owned(),
                value: values[row],
                time,
            });
        }
    }
    Ok(())
}

/// Logs whose battery nobody measured, under a model that wants to know.
#[must_use]
pub fn without_battery(model: &Model, logs: &[ScreenedLog]) -> Vec<Finding> {
    let drives =
        |log: &&Dataset| log.names().any(|name| rotor_of(name).is_some() && columns::is_command(name));
    let lacks = |log: &&Dataset| log.column(columns::BATTERY_VOLTAGE).is_none();
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
        assert_eq!(check_magnitudes(&log("a.csv", "", 0.6)), Ok(()));
        let error = check_magnitudes(&log("a.csv", "", -1e160)).expect_err("absurd");
        let expected = ScreeningError::Magnitude {
            log: "a.csv".to_owned(),
            column: "command_1".to_owned(),
            value: -1e160,
            time: 1.0,
        };
        assert_eq!(error, expected);
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
