//! Units and columns that were mistaken, for whoever holds a model against logs: what an identification asks of them
//! before it begins, and what else a model of the bench can tell.

use super::IdentifyError;
use super::command_response::Alone;
use crate::estimation::quantile::{median, quantile};
use crate::log::Dataset;
use crate::model::Model;
use crate::screening::attitude_units::{self, Mistaken};
use crate::screening::battery_range::EMPTY;
use crate::screening::plausibility::{ANOTHER, LEAST_HELD, UNITS, is_another, told, too_far_apart};
use crate::screening::rotor_data::{LEAST_COMMAND, RotorLog, bounds};
use crate::screening::{Finding, ScreeningError};

/// [s] samples of an attitude further apart than this tell nothing of how the body moves.
const SLOWEST: f64 = 2.0;
/// Share of the model's greatest rate in the log from which a rate is held against it: where a curve begins it may be anything.
const FAIR: f64 = 0.3;
/// A unit is one factor in all rows: between the quarters of the ratios at most this factor, or something else is wrong.
const ALIKE: f64 = 1.3;
/// Factor between a unit's and the ratio that was found, within which it is that unit.
const LIKE: f64 = 1.5;
/// Share of the full battery between which a battery in use lies.
const IN_USE: std::ops::Range<f64> = 0.6..1.1;
/// Factor above the model's full battery from which a battery is another one, and the one from which it is told.
const OTHER_BATTERY: (f64, f64) = (4.5, 1.1);
/// Parts of a volt that a voltage may have been written in, and how to import it then.
const VOLTS: [(f64, &str); 3] = [
    (1e3, "millivolts: unit `mV`"),
    (1e2, "hundredths of a volt: scale 0.01"),
    (1e1, "tenths of a volt: scale 0.1 (a charge in percent is no voltage: leave that column out)"),
];

/// What to say of columns that can hardly be what their names say; `model` is the bench's.
///
/// # Errors
/// [`IdentifyError::Unit`] of a column that cannot be: whatever is fitted to it would be told as physics.
pub fn check_columns(logs: &[Dataset], model: &Model) -> Result<Vec<Finding>, IdentifyError> {
    let mut rotors = Vec::new();
    let mut said = Vec::new();
    for log in logs {
        for rotor in [1, 2] {
            let Some((mut rotor, _)) = RotorLog::read(log, rotor) else { continue };
            // A rotor that stood has nothing to say.
            if bounds(&rotor.command).1 < LEAST_COMMAND {
                continue;
            }
            refuse(rotor.battery_in_another_unit(model))?;
            said.extend(rotor.mistaken()?);
            refuse(rotor.rate_in_another_unit(model))?;
            said.extend(rotor.other_battery(model).map(Finding::from));
            rotor.leave_out_starts(&mut Vec::new());
            rotor.leave_out_unmoved(&mut Vec::new());
            rotors.push(rotor);
        }
        said.extend(check_attitude(log)?);
    }
    rotors.retain(|rotor| rotor.scored().next().is_some());
    Alone::look(&rotors, model.actuator.full_voltage).refuse(Some(model.actuator.pole))?;
    Ok(said)
}

fn check_attitude(log: &Dataset) -> Result<Option<Finding>, IdentifyError> {
    let Some(rate) = log.column("body_rate_rad_s") else { return Ok(None) };
    let interval = log.median_interval();
    if interval > SLOWEST {
        let finding = too_far_apart(log.source_name(), "body_rate_rad_s", interval);
        return Err(ScreeningError::Column(Box::new(finding)).into());
    }
    match attitude_units::mistaken(log, rate) {
        Some(Mistaken::Rate(finding) | Mistaken::Angle(finding)) => {
            Err(ScreeningError::Column(Box::new(finding)).into())
        }
        Some(Mistaken::Perhaps(finding)) => Ok(Some(finding)),
        None => Ok(None),
    }
}

fn refuse(sentence: Option<String>) -> Result<(), IdentifyError> {
    sentence.map_or(Ok(()), |sentence| Err(IdentifyError::Unit(sentence)))
}

impl RotorLog {
    /// What to say of rates that are those of the model's rotor in another unit.
    fn rate_in_another_unit(&self, model: &Model) -> Option<String> {
        let expected = |row: usize| model.steady_rate(self.command[row]);
        let rows = || self.segments.iter().cloned().flatten().filter(|row| self.command[*row] >= LEAST_HELD);
        let fair = FAIR * rows().map(expected).fold(0.0, f64::max);
        let ratios = rows().filter(|row| fair > 0.0 && expected(*row) >= fair);
        let ratios: Vec<f64> = ratios.map(|row| self.rate[row].abs() / expected(row)).collect();
        let of = |share: f64| quantile(ratios.iter().copied(), share).unwrap_or(0.0);
        let [low, ratio, high] = [0.25, 0.5, 0.75].map(of);
        if !is_another(&ratio, ANOTHER) || high > ALIKE * low {
            return None;
        }
        let is_like = |unit: &&(&str, f64)| (1.0 / LIKE..LIKE).contains(&(ratio / unit.1));
        let (name, _) = UNITS.iter().find(is_like)?;
        let (least, most) = bounds(&self.rate);
        Some(format!(
            "{}: rates from {least:.4} to {most:.4} rad/s are {} times what the model's rotor does at these commands, as {name} \
             are; if the column is in {name}, import it with unit `{name}`; if it is another rotor, make its model first \
             (`rotorbench identify`)",
            self.source,
            told(ratio)
        ))
    }

    /// What to say of a voltage that is the model's battery in another unit, or that no battery has.
    fn battery_in_another_unit(&self, model: &Model) -> Option<String> {
        let voltage = self.voltage.as_deref()?;
        let (least, most) = bounds(voltage);
        let middle = median(voltage.iter().copied()).unwrap_or(0.0);
        if middle < EMPTY {
            return Some(format!(
                "{}: `battery_voltage_v` reads {least:.2} to {most:.2} V, which no battery has that turns a rotor: it is not \
                 connected, or it is another column; leave it out",
                self.source
            ));
        }
        let full = model.actuator.full_voltage;
        let is_like = |unit: &&(f64, &str)| IN_USE.contains(&(middle / full / unit.0));
        let named = VOLTS.iter().find(is_like).map(|(_, how)| format!("in {how}"));
        let is_other = middle > OTHER_BATTERY.0 * full && model.actuator.voltage_gain != 0.0;
        (named.is_some() || is_other).then(|| {
            format!(
                "{}: battery voltages from {least:.3} to {most:.3} V are not those of the model's battery, which has {full:.1} V \
                 when full; {}; if it is another battery, make its model first (`rotorbench identify`)",
                self.source,
                named.map_or_else(
                    || "a charge in percent is no voltage (leave that column out)".to_owned(),
                    |named| format!("import the column {named}")
                )
            )
        })
    }

    /// What to say of a battery that has more than the model's has when full.
    fn other_battery(&self, model: &Model) -> Option<String> {
        let (middle, full) = (median(self.voltage.as_ref()?.iter().copied())?, model.actuator.full_voltage);
        (middle > OTHER_BATTERY.1 * full && model.actuator.voltage_gain != 0.0).then(|| {
            format!(
                "{}: the battery had {middle:.1} V, and the model's has {full:.1} V when full: is it the model of this bench, and \
                 the column a voltage? (`rotorbench identify` makes a model)",
                self.source
            )
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
            rate += (1.0 - (-0.02 * pole).exp()) * (curve(*command) - rate);
            read(rate)
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

    fn said(log: Dataset, model: &Model) -> Result<Vec<String>, String> {
        check_columns(&crate::screening::screened(&[log], &mut Vec::new()), model)
            .map(|found| found.iter().map(ToString::to_string).collect())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_unit_is_one_factor_and_of_the_models_own_curve() {
        let paper = Model::paper();
        let curve = |u: f64| paper.steady_rate(u);
        assert_eq!(said(log(16.0, curve, |rate| rate), &paper), Ok(vec![]));
        let refused = said(log(16.0, curve, |rate| rate * 30.0 / std::f64::consts::PI), &paper);
        assert!(refused.is_err_and(|it| it.contains("unit `rpm`")));
        // A dead zone makes rates that are a tenth, and less, and not everywhere as much less.
        let dead = said(log(16.0, |u| curve((u - 0.5).max(0.0)), |rate| rate), &paper);
        assert_eq!(dead, Ok(vec![]));
        // A controller of its own that holds the rate, whatever the command.
        let mut governed = Model::paper();
        governed.actuator.steady_rate = vec![600.0, 30.0];
        assert_eq!(said(log(16.0, |u| governed.steady_rate(u), |rate| rate), &governed), Ok(vec![]));
    }

    #[test]
    fn a_slow_rotor_is_one_unless_its_time_is_in_milliseconds() {
        let paper = Model::paper();
        let curve = |u: f64| paper.steady_rate(u);
        assert_eq!(said(log(0.15, curve, |rate| rate), &paper), Ok(vec![]));
        let refused = said(log(0.016, curve, |rate| rate), &paper);
        assert!(refused.is_err_and(|it| it.contains("milliseconds")));
    }

    #[test]
    fn a_few_flipped_bits_of_a_reading_are_not_its_unit() {
        let paper = Model::paper();
        let with = |bits: &dyn Fn(usize) -> f64| {
            let mut log = log(16.0, |u| paper.steady_rate(u), |rate| rate);
            volts(&mut log, bits);
            said(log, &paper)
        };
        assert_eq!(with(&|row| if row == 700 { 6553.5 } else { 12.2 }), Ok(vec![]));
        assert!(with(&|_| 45.0).is_ok_and(|said| said.len() == 1 && said[0].contains("45.0 V")));
        for (volts, words) in
            [(12_200.0, "unit `mV`"), (1220.0, "scale 0.01"), (90.0, "percent"), (0.02, "not connected")]
        {
            assert!(with(&|_| volts).is_err_and(|it| it.contains(words)), "{volts}");
        }
    }
}
