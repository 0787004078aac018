//! What logs must be like before any model is held against them, in sentences that both commands share.

use crate::log::Dataset;
use crate::model::Model;

/// [SI] no bench measures more than this; its square is still a number, its product with others too.
const LARGEST: f64 = 1e100;

/// A value that no bench can have measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "{log}: `{column}` is {value:e} at {time} s: no bench measures that; leave such cells empty, or `import` with `valid` in the mapping"
)]
pub struct Absurd {
    /// The log.
    pub log: String,
    /// The column.
    pub column: String,
    /// In the column's unit.
    pub value: f64,
    /// [s] where.
    pub time: f64,
}

/// Refuses values whose squares are no numbers.
///
/// # Errors
/// [`Absurd`] names the first.
pub fn check_magnitudes(log: &Dataset) -> Result<(), Absurd> {
    for column in log.names() {
        let values = log.column(column).unwrap_or(&[]);
        if let Some(row) = values.iter().position(|value| value.abs() > LARGEST) {
            let (log_name, time) = (log.source_name().to_owned(), log.time()[row]);
            return Err(Absurd { log: log_name, column: column.to_owned(), value: values[row], time });
        }
    }
    Ok(())
}

/// What no log of these has, and what each of them holds instead.
#[must_use]
pub fn nothing_in_common(logs: &[&Dataset]) -> String {
    let held: Vec<String> =
        logs.iter().map(|log| format!("{} holds {}", log.source_name(), columns(log))).collect();
    format!(
        "nothing to compare: a rotor needs its command and its rate (`command_1` with `propeller_rate_1_rad_s`), the body \
         needs `body_rate_rad_s` with the rates or commands of both rotors or with `torque_command_nm`; {}",
        held.join("; ")
    )
}

fn columns(log: &Dataset) -> String {
    let names: Vec<&str> = log.names().collect();
    if names.is_empty() {
        return "nothing but time".to_owned();
    }
    let told = names.iter().map(|name| {
        let empty = !log.column(name).unwrap_or(&[]).iter().any(|value| value.is_finite());
        if empty { format!("`{name}` (without a value)") } else { format!("`{name}`") }
    });
    told.collect::<Vec<_>>().join(", ")
}

/// Logs whose battery nobody measured, under a model that wants to know.
#[must_use]
pub fn without_battery(model: &Model, logs: &[Dataset]) -> Vec<String> {
    let drives = |log: &&Dataset| log.names().any(|name| name == "command_1" || name == "command_2");
    let lacks = |log: &&Dataset| log.column("battery_voltage_v").is_none();
    let wants =
        model.actuator.voltage_gain != 0.0 || model.has("battery_sag") || model.has("battery_scaling");
    let told = logs.iter().filter(|log| wants && drives(log) && lacks(log));
    told.map(|log| {
        format!(
            "{}: no `battery_voltage_v`: the battery counts as full, and its sag shows as an error",
            log.source_name()
        )
    })
    .collect()
}

/// Logs that are there twice: what was fitted cannot judge the fit.
#[must_use]
pub fn repeated(train: &[Dataset], validate: &[Dataset]) -> Vec<String> {
    // Two parts of one recording are two logs.
    let is_same = |one: &Dataset, other: &Dataset| {
        let ends = |log: &Dataset| (log.time().first().copied(), log.time().last().copied());
        one.sha256() == other.sha256() && ends(one) == ends(other)
    };
    let mut said = Vec::new();
    for (index, log) in train.iter().enumerate() {
        if train[..index].iter().any(|other| is_same(log, other)) {
            said.push(format!("{} is given twice: it counts double", log.source_name()));
        }
    }
    for log in validate {
        if train.iter().any(|other| is_same(log, other)) {
            said.push(format!(
                "{} is fitted on and judged on: its held-out error is none, and every effect looks better than it is",
                log.source_name()
            ));
        }
    }
    said
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(name: &str, hash: &str, value: f64) -> Dataset {
        let mut log = Dataset::new(name, hash, vec![0.0, 1.0]).expect("time rises");
        log.insert("command_1", vec![0.5, value]).expect("fits");
        log.insert("current_1_a", vec![f64::NAN; 2]).expect("fits");
        log
    }

    #[test]
    fn a_value_that_no_bench_measures_is_named_with_its_place() {
        assert_eq!(check_magnitudes(&log("a.csv", "", 0.6)), Ok(()));
        let error = check_magnitudes(&log("a.csv", "", -1e160)).expect_err("absurd").to_string();
        assert!(error.starts_with("a.csv: `command_1` is -1e160 at 1 s:"), "{error}");
    }

    #[test]
    fn columns_without_a_value_are_told_from_those_with_one() {
        let sentence = nothing_in_common(&[&log("a.csv", "", 0.6)]);
        assert!(sentence.ends_with("a.csv holds `command_1`, `current_1_a` (without a value)"), "{sentence}");
    }

    #[test]
    fn a_log_that_is_fitted_and_judged_is_told() {
        let one = [log("a.csv", "1", 0.6)];
        let both = [log("a.csv", "1", 0.6), log("b.csv", "2", 0.6)];
        assert!(repeated(&one, &both[1..]).is_empty());
        assert!(repeated(&both, &one)[0].starts_with("a.csv is fitted on and judged on"));
        assert!(repeated(&[&one[..], &one[..]].concat(), &[])[0].contains("twice"));
        let later = Dataset::new("a.csv", "1", vec![1.0, 2.0]).expect("time rises");
        assert!(repeated(&one, &[later]).is_empty(), "another part of the same recording");
    }
}
