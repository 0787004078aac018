//! Units and columns that were mistaken, for whoever holds a model against logs: what an identification asks of them
//! before it begins, and what else a model of the bench can tell.

use super::IdentifyError;
use super::command_response::CommandResponses;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{median, quantile};
use crate::log::Dataset;
use crate::model::Model;
use crate::screening::attitude::Mistaken;
use crate::screening::attitude_units;
use crate::screening::plausibility::{ANOTHER, LEAST_HELD, UNITS, is_another, too_far_apart};
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::{Finding, ScreenedLog, ScreeningError};
use crate::signal::columns;

/// Parts of a volt that a voltage may have been written in.
const VOLTS: [(f64, &str); 3] = [(1e3, "mV"), (1e2, "0.01 V"), (1e1, "0.1 V")];

/// Columns that can hardly be what their names say, by a model of the bench; what needs no model is in the screened logs.
///
/// # Errors
/// [`IdentifyError`] of a column that cannot be: whatever is fitted to it would pass for physics.
pub fn check_columns(logs: &[ScreenedLog], model: &Model) -> Result<Vec<Finding>, IdentifyError> {
    let mut rotors = Vec::new();
    let mut found: Vec<Finding> = Vec::new();
    for log in logs {
        // A rotor that stood has nothing to say.
        for rotor in log.rotors().filter(|it| it.turns()) {
            let data = rotor.data();
            refuse(data.battery_in_another_unit(model))?;
            rotor.refuse()?;
            refuse(data.rate_in_another_unit(model))?;
            found.extend(data.other_battery(model));
            rotors.extend(rotor.scored().next().map(|_| data.clone()));
        }
        found.extend(check_attitude(log.dataset())?);
    }
    let responses = CommandResponses::fit(&rotors, model.actuator.full_voltage);
    responses.refuse(Some(model.actuator.pole))?;
    found.extend(responses.lead());
    Ok(found)
}

fn check_attitude(log: &Dataset) -> Result<Option<Finding>, IdentifyError> {
    let Some(rate) = log.column(columns::BODY_RATE) else { return Ok(None) };
    let interval = log.median_interval();
    if interval > THRESHOLDS.sparsest_attitude {
        refuse(Some(too_far_apart(log.source_name(), columns::BODY_RATE, interval)))?;
    }
    match attitude_units::mistaken(log, rate) {
        Some(Mistaken::Rate(finding) | Mistaken::Angle(finding)) => refuse(Some(finding)).map(|()| None),
        Some(Mistaken::Perhaps(finding)) => Ok(Some(finding)),
        None => Ok(None),
    }
}

fn refuse(found: Option<Finding>) -> Result<(), IdentifyError> {
    found.map_or(Ok(()), |found| Err(ScreeningError::Column(Box::new(found)).into()))
}

impl RotorLog {
    /// Rates that are those of the model's rotor in another unit.
    fn rate_in_another_unit(&self, model: &Model) -> Option<Finding> {
        let expected = |row: usize| model.steady_rate(self.command[row]);
        let rows = || self.segments.iter().cloned().flatten().filter(|row| self.command[*row] >= LEAST_HELD);
        let fair = THRESHOLDS.fair_rate_share * rows().map(expected).fold(0.0, f64::max);
        let ratios = rows().filter(|row| fair > 0.0 && expected(*row) >= fair);
        let ratios: Vec<f64> = ratios.map(|row| self.rate[row].abs() / expected(row)).collect();
        let of = |share: f64| quantile(ratios.iter().copied(), share).unwrap_or(0.0);
        let [low, ratio, high] = [0.25, 0.5, 0.75].map(of);
        if !is_another(&ratio, ANOTHER) || high > THRESHOLDS.unit_ratio_spread * low {
            return None;
        }
        let is_like = |unit: &&(&str, f64)| {
            (1.0 / THRESHOLDS.unit_factor..THRESHOLDS.unit_factor).contains(&(ratio / unit.1))
        };
        let (unit, _) = UNITS.iter().find(is_like)?;
        let (lowest, highest) = bounds(&self.rate);
        let found = self.finding("rate_in_other_unit").with("ratio", ratio).with("unit", *unit);
        Some(found.with("lowest_rad_s", lowest).with("highest_rad_s", highest))
    }

    /// A voltage that is the model's battery in another unit.
    fn battery_in_another_unit(&self, model: &Model) -> Option<Finding> {
        let voltage = self.voltage.as_deref()?;
        let (lowest, highest) = bounds(voltage);
        let middle = median(voltage.iter().copied()).unwrap_or(0.0);
        let full = model.actuator.full_voltage;
        let [least, most] = THRESHOLDS.battery_in_use;
        let is_like = |unit: &&(f64, &str)| (least..most).contains(&(middle / full / unit.0));
        let unit = VOLTS.iter().find(is_like).map(|(_, unit)| *unit);
        let is_other = middle > THRESHOLDS.other_battery_refused * full && model.actuator.voltage_gain != 0.0;
        (unit.is_some() || is_other).then(|| {
            let found = self.finding("battery_in_other_unit").with("unit", unit.unwrap_or_default());
            let found = found.with("lowest_v", lowest).with("highest_v", highest);
            found.with("full_voltage_v", full)
        })
    }

    /// A battery that has more than the model's has when full.
    fn other_battery(&self, model: &Model) -> Option<Finding> {
        let (middle, full) = (median(self.voltage.as_ref()?.iter().copied())?, model.actuator.full_voltage);
        (middle > THRESHOLDS.other_battery_noted * full && model.actuator.voltage_gain != 0.0).then(|| {
            let found = self.finding("battery_of_other_bench").with("voltage_v", middle);
            found.with("full_voltage_v", full)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 60 s at 50 Hz: a rotor that follows g(u) of commands from 0.2 to 0.6 with `pole` [1/s], its rate through `read`.
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
        let mut log = Dataset::new("made.csv", "", time).expect("time rises");
        log.insert("command_1", command).expect("fits");
        log.insert("propeller_rate_1_rad_s", rates).expect("fits");
        log
    }

    fn volts(log: &mut Dataset, volts: impl Fn(usize) -> f64) {
        let volts = (0..log.len()).map(volts).collect();
        log.insert("battery_voltage_v", volts).expect("fits");
    }

    fn check(log: Dataset, model: &Model) -> Result<Vec<Finding>, Finding> {
        check_columns(&[log.into()], model).map_err(IdentifyError::into_finding)
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
        let mut late = Dataset::new("late.csv", "", right.time().to_vec()).expect("time rises");
        late.insert("command_1", written).expect("fits");
        late.insert("propeller_rate_1_rad_s", column("propeller_rate_1_rad_s")).expect("fits");
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
        assert_eq!(check(log(0.15, curve, |rate| rate), &paper), Ok(vec![]));
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
