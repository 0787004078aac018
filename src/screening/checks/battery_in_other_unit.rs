//! Voltages that are those of the model's battery in another unit, or of no battery like it.

use crate::estimation::quantile::median;
use crate::model::Model;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::{Stops, Suspicion};
use crate::screening::thresholds::THRESHOLDS;

/// Parts of a volt that a voltage may have been written in.
const VOLTS: [(f64, &str); 3] = [(1e3, "mV"), (1e2, "0.01 V"), (1e1, "0.1 V")];

/// A voltage that is the model's battery in another unit. One that no battery of such a bench has stops all: k_V would be fitted to
/// it. Whoever has such a battery says so by the full voltage of the template.
pub(crate) fn check(rotor: &RotorLog, model: &Model) -> Option<Suspicion> {
    let voltage = rotor.voltage.as_deref()?;
    let (lowest, highest) = bounds(voltage);
    let middle = median(voltage.iter().copied()).unwrap_or(0.0);
    let full = model.actuator.full_voltage;
    let [least, most] = THRESHOLDS.battery_in_use;
    let is_like = |unit: &&(f64, &str)| (least..most).contains(&(middle / full / unit.0));
    let is_impossible = middle > THRESHOLDS.high_voltage;
    // Of a battery that is not the model's: the part of a volt in which it would be one at all; a hundredth is the rarest.
    let [mv, hundredths, tenths] = &VOLTS;
    let of_battery = THRESHOLDS.lowest_battery..THRESHOLDS.high_voltage;
    let is_battery = |unit: &&(f64, &str)| is_impossible && of_battery.contains(&(highest / unit.0));
    let of_model = VOLTS.iter().find(is_like);
    let unit = of_model.or_else(|| [tenths, mv, hundredths].into_iter().find(is_battery));
    let unit = unit.map(|(_, unit)| *unit);
    let is_other = middle > THRESHOLDS.other_battery_refused * full && model.actuator.voltage_gain != 0.0;
    let finding = rotor.finding("battery_in_other_unit").with("unit", unit.unwrap_or_default());
    let finding = finding.with("lowest_v", lowest).with("highest_v", highest).with("full_voltage_v", full);
    let stops = if is_impossible { Stops::Fits } else { Stops::Searches };
    (of_model.is_some() || is_other).then_some(Suspicion { finding, stops })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// The unit that is named of a battery that reads so much, beside the paper's of 12.6 V, and whom it stops.
    fn named(reading: f64) -> (String, Stops) {
        let time: Vec<f64> = (0..1000).map(|row| 0.02 * f64::from(row)).collect();
        let command: Vec<f64> = (0..1000).map(|row| 0.3 + 0.1 * f64::from(row / 50 % 5)).collect();
        let rates: Vec<f64> = command.iter().map(|command| Model::paper().steady_rate(*command)).collect();
        let volts = (0..1000).map(|row| reading * (1.0 - 2e-5 * f64::from(row))).collect();
        let log = Dataset::made(
            time,
            [("command_1", command), ("propeller_rate_1_rad_s", rates), ("battery_voltage_v", volts)],
        );
        let log = ScreenedLog::of(&log);
        let found = check(log.rotor(1).expect("a rotor").data(), &Model::paper()).expect("another battery");
        (found.finding.text("unit").to_owned(), found.stops)
    }

    #[test]
    fn the_part_of_a_volt_is_named_of_a_battery_that_is_not_the_models_too() {
        // Of three cells, the model's battery; of six, and of two and of one, others.
        for (reading, unit) in [
            (12_400.0, "mV"),
            (124.0, "0.1 V"),
            (25_100.0, "mV"),
            (251.0, "0.1 V"),
            (2_510.0, "0.01 V"),
            (7_400.0, "mV"),
            (3_700.0, "mV"),
        ] {
            assert_eq!(named(reading), (unit.to_owned(), Stops::Fits), "{reading}");
        }
    }
}
