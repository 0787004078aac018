//! Units and columns that were mistaken: the one judgement that every command takes before anything is fitted for it. `import` and
//! `compare` say all of it; `identify` refuses what nothing can be fitted to; `diagnose`, `discover` and `extend` refuse, too, what cannot
//! be of the model's bench. What needs no fit is in `screening`; whether rates follow their commands is asked here.

use super::command_response::CommandResponses;
use super::inputs;
use crate::log::signals::MOST_ROTORS;
use crate::model::Model;
use crate::screening::rotor_data::RotorLog;
use crate::screening::suspicion::{Stops, Suspicions};
use crate::screening::{Finding, ScreenedLog, ScreenedRotor, ScreeningError, requirements};

/// What is said of logs beside a model of their bench: columns that can hardly be what their names say, and what they lack for it.
#[must_use]
pub fn mistaken_and_lacking(logs: &[ScreenedLog], model: &Model) -> [Vec<Finding>; 2] {
    let found = suspicions(logs, model, &every_rotor());
    [found.mistaken().cloned().collect(), found.lacking]
}

/// Refuses logs in which a search with `model` would take a column for physics that is not what its name says; says what else was
/// found beside the model.
///
/// # Errors
/// [`ScreeningError::Column`] of what stops most.
pub fn check_columns(logs: &[ScreenedLog], model: &Model) -> Result<Vec<Finding>, ScreeningError> {
    let found = suspicions(logs, model, &every_rotor());
    found.refuse(Stops::Searches)?;
    Ok(beside_logs(&found, logs))
}

fn every_rotor() -> Vec<usize> {
    (1..=MOST_ROTORS).collect()
}

/// What is not said of the logs by themselves.
pub(crate) fn beside_logs(found: &Suspicions, logs: &[ScreenedLog]) -> Vec<Finding> {
    let is_of_log = |finding: &Finding| logs.iter().any(|log| log.findings().any(|it| it == finding));
    found.findings().filter(|finding| !is_of_log(finding)).cloned().collect()
}

/// What can hardly be what its name says in logs, of these rotors, what stops most first.
pub(crate) fn suspicions(logs: &[ScreenedLog], model: &Model, rotors: &[usize]) -> Suspicions {
    let mut found = requirements::suspicions(logs, model, rotors);
    let lacking = requirements::lacking(logs, model, rotors);
    // What would be fitted to columns that cannot be what they are said to be says nothing of the commands.
    if found.iter().any(|it| it.stops == Stops::Fits) {
        return Suspicions::of(found, lacking);
    }
    let turning = |log| ScreenedLog::rotors(log).filter(|it| it.turns() && rotors.contains(&it.number()));
    // Rows that are levels each hold no response.
    let responds =
        |rotor: &&ScreenedRotor| rotor.scored().next().is_some() && !rotor.data().rows_are_levels();
    let measured = logs.iter().flat_map(turning).filter(responds);
    let measured: Vec<RotorLog> = measured.map(|rotor| rotor.data().clone()).collect();
    let full_voltage = inputs::fuller_battery(logs, model).unwrap_or(model.actuator.full_voltage);
    found.extend(CommandResponses::fit(&measured, full_voltage).suspicions(model.actuator.pole));
    Suspicions::of(found, lacking)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;

    /// 60 s at 50 Hz: a rotor that follows g(u) of commands from 0.2 to 0.6 with `pole` [rad/s], its rate through `read`.
    fn log(pole: f64, curve: impl Fn(f64) -> f64, read: impl Fn(f64) -> f64) -> Dataset {
        let time: Vec<f64> = (0..3000).map(|row| 0.02 * f64::from(row)).collect();
        // Levels that are held for 0.3 s, none of them twice running.
        let command: Vec<f64> =
            (0..3000).map(|row| 0.2 + 0.4 * f64::from(row / 15 * 37 % 101) / 101.0).collect();
        let mut rate = curve(command[0]);
        let follow = |command: &f64| {
            // A command holds from its row on.
            let now = rate;
            rate += (1.0 - (-0.02 * pole).exp()) * (curve(*command) - rate);
            read(now)
        };
        let rates = command.iter().map(follow).collect();
        Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)])
    }

    fn volts(log: &mut Dataset, volts: impl Fn(usize) -> f64) {
        let volts = (0..log.len()).map(volts).collect();
        log.insert("battery_voltage_v", volts).expect("fits");
    }

    fn check(log: Dataset, model: &Model) -> Result<Vec<Finding>, Finding> {
        let found = check_columns(&[log.into()], model).map_err(|error| match error {
            ScreeningError::Column(finding) => *finding,
            other => panic!("{other}"),
        })?;
        // Most of these have none.
        Ok(found.into_iter().filter(|it| it.code != "no_battery_voltage").collect())
    }

    #[test]
    fn a_unit_is_one_factor_and_of_the_models_own_curve() {
        let paper = Model::paper();
        let curve = |u: f64| paper.steady_rate(u);
        assert_eq!(check(log(16.0, curve, |rate| rate), &paper), Ok(vec![]));
        let refused = check(log(16.0, curve, |rate| rate * 30.0 / std::f64::consts::PI), &paper);
        assert!(refused.is_err_and(|it| it.code == "rate_too_fast"));
        // A dead zone makes rates that are a tenth, and less, and not everywhere as much less.
        let dead = check(log(16.0, |u| curve((u - 0.5).max(0.0)), |rate| rate), &paper);
        assert_eq!(dead, Ok(vec![]));
        // A controller of its own that holds the rate, whatever the command.
        let mut governed = Model::paper();
        governed.actuator.steady_rate = vec![600.0, 30.0];
        assert_eq!(check(log(16.0, |u| governed.steady_rate(u), |rate| rate), &governed), Ok(vec![]));
    }

    #[test]
    fn commands_that_are_written_a_row_late_are_found() {
        let paper = Model::paper();
        let right = log(16.0, |u| paper.steady_rate(u), |rate| rate);
        let column = |name: &str| right.column(name).expect("there").to_vec();
        let sent = column("command_1");
        let written = (0..sent.len()).map(|row| sent[row.saturating_sub(1)]).collect();
        let late = Dataset::made(
            right.time().to_vec(),
            [("command_1", written), ("propeller_rate_1_rad_s", column("propeller_rate_1_rad_s"))],
        );
        let found = check(late, &paper).expect("not refused");
        assert_eq!(
            (found.len(), found[0].code, found[0].number("rows_earlier")),
            (1, "rates_lead_commands", 1.0)
        );
    }

    #[test]
    fn a_slow_rotor_is_one_unless_its_time_is_in_milliseconds() {
        let paper = Model::paper();
        let curve = |u: f64| paper.steady_rate(u);
        let slow = check(log(0.15, curve, |rate| rate), &paper).expect("not refused");
        assert_eq!(slow.iter().map(|it| it.code).collect::<Vec<_>>(), ["rotor_too_slow"]);
        let refused = check(log(0.016, curve, |rate| rate), &paper);
        assert!(refused.is_err_and(|it| it.code == "rotor_too_slow"));
    }

    #[test]
    fn a_few_flipped_bits_of_a_reading_are_not_its_unit() {
        let paper = Model::paper();
        let with = |bits: &dyn Fn(usize) -> f64| {
            let mut log = log(16.0, |u| paper.steady_rate(u), |rate| rate);
            volts(&mut log, bits);
            check(log, &paper)
        };
        assert_eq!(with(&|row| if row == 700 { 6553.5 } else { 12.2 }), Ok(vec![]));
        assert_eq!(with(&|_| 0.02), Ok(vec![]), "not connected: as if it had not been read");
        assert!(with(&|_| 45.0).is_ok_and(|it| it.len() == 1 && it[0].number("voltage_v") == 45.0));
        for (volts, code, unit) in [
            (12_200.0, "battery_in_other_unit", "mV"),
            (1220.0, "battery_in_other_unit", "0.01 V"),
            (90.0, "battery_in_other_unit", "0.1 V"),
        ] {
            let refused = with(&|_| volts);
            assert!(refused.is_err_and(|it| it.code == code && it.text("unit") == unit), "{volts}");
        }
    }
}
