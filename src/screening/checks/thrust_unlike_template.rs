//! Thrusts that are those of another unit, by what the model's rotor does at the same commands.

use crate::estimation::quantile::{median, quantile};
use crate::model::Model;
use crate::screening::plausibility::{self, LEAST_HELD, MOST, is_another, nearest};
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::{Stops, Suspicion};
use crate::screening::thresholds::THRESHOLDS;
use crate::signal::columns;
use crate::unit::STANDARD_GRAVITY;

/// Units that a thrust may have been written in and that are far from 1 N, and what they say for 1 N.
const UNITS: [(&str, f64); 3] =
    [("gf", 1e3 / STANDARD_GRAVITY), ("kgf", 1.0 / STANDARD_GRAVITY), ("mN", 1e3)];

/// Units nearer to 1 N. Another propeller's thrusts are as near: they are asked for only within a share of what they would say, and
/// where the rates are the model's within as much.
const NEAR_UNITS: [(&str, f64); 2] =
    [("lbf", 1.0 / 4.448_221_615_260_5), ("ozf", 16.0 / 4.448_221_615_260_5)];

/// [kg/m³] of the air at sea level: what a propeller makes its thrust of.
const AIR: f64 = 1.225;

/// Thrusts that are many times the model's, or few of it, and the unit that would say so. What is below zero has the wrong
/// sign, which is found where the curve is fitted. No search takes a unit for physics; who makes a model of another propeller is
/// stopped where none makes such thrusts.
pub(crate) fn check(rotor: &RotorLog, model: &Model) -> Option<Suspicion> {
    let thrust = rotor.thrust.as_deref()?;
    let coefficient = model.actuator.thrust_coefficient;
    let of_thrusts = rotor.middle(model, |row, expected| thrust[row] / (coefficient * expected * expected));
    let ratio = of_thrusts.filter(|ratio| *ratio > 0.0)?;
    let of_rates = rotor.rate_ratio(model);
    let is_near = |unit: &&(&str, f64)| !is_another(&(ratio / unit.1), THRESHOLDS.near_unit);
    let near = NEAR_UNITS
        .iter()
        .find(is_near)
        .filter(|_| of_rates.is_some_and(|it| !is_another(&it, THRESHOLDS.near_unit)));
    let unit = match near {
        Some((unit, _)) => Some(*unit),
        // Of another rotor than the model's its tips say so: grams are what thrust stands write.
        None if is_another(&ratio, THRESHOLDS.another_thrust_unit) => {
            let by_tips =
                || (ratio > 1.0 && is_faster_than_any(rotor, thrust, of_rates)).then_some(UNITS[0].0);
            nearest(&UNITS, ratio).or_else(by_tips)
        }
        None => return None,
    };
    let (least, most) = bounds(thrust);
    let finding = rotor.finding("thrust_unlike_template").with("least", least).with("greatest", most);
    let finding = finding.with("ratio", ratio).with("unit", unit.unwrap_or_default());
    let finding = finding.with("column", columns::thrust(rotor.number));
    let stops = unit.map_or(Stops::Nobody, |unit| stops(rotor, thrust, unit, coefficient, of_rates));
    Some(Suspicion { finding, stops })
}

/// Whom thrusts stop that may be in this unit, beside rates that are so many times the model's.
fn stops(rotor: &RotorLog, thrust: &[f64], unit: &str, coefficient: f64, of_rates: Option<f64>) -> Stops {
    let Some((_, scale)) = UNITS.iter().find(|(name, _)| *name == unit) else { return Stops::Nobody };
    // By the rates beside them: what a battery or a lag does to those is none of the unit.
    let is_held = |row: &usize| rotor.command[*row] >= LEAST_HELD && rotor.rate[*row] > 0.0;
    let rows = rotor.stretches.iter().cloned().flatten().filter(is_held);
    let found = median(rows.map(|row| thrust[row] / (coefficient * rotor.rate[row].powi(2))));
    let is_unit = found.is_some_and(|it| !is_another(&(it / scale), THRESHOLDS.unit_factor));
    let is_rotor = of_rates.is_some_and(|it| !is_another(&it, THRESHOLDS.unit_factor));
    // Another propeller may push a tenth as hard at the same rates, and none a hundred times.
    let is_impossible = *scale > 1.0 && (is_unit && is_rotor || is_faster_than_any(rotor, thrust, of_rates));
    match (is_impossible, is_unit) {
        (true, _) => Stops::Fits,
        (false, true) => Stops::Searches,
        (false, false) => Stops::Nobody,
    }
}

/// Whether the tips of the smallest propeller that makes such thrusts would turn faster than any do: T = C_T ρ n² D⁴. Rates that may be
/// in another unit themselves say nothing of it.
fn is_faster_than_any(rotor: &RotorLog, thrust: &[f64], of_rates: Option<f64>) -> bool {
    let is_other_rate = of_rates.is_some_and(|it| nearest(&plausibility::UNITS, it).is_some());
    let is_too_fast = bounds(&rotor.rate).1 > THRESHOLDS.impossible_rate
        || -bounds(&rotor.rate).0 > THRESHOLDS.impossible_rate;
    if is_other_rate || is_too_fast {
        return false;
    }
    let of_disc = (std::f64::consts::TAU).powi(2) / (THRESHOLDS.greatest_thrust_coefficient * AIR);
    let tip = |row: usize| 0.5 * (of_disc * thrust[row].abs()).powf(0.25) * rotor.rate[row].abs().sqrt();
    let tips = rotor.stretches.iter().cloned().flatten().map(tip);
    quantile(tips.filter(|it| it.is_finite()), MOST).is_some_and(|it| it > THRESHOLDS.fastest_tip)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// Whom a rotor stops whose rates are `rate` times the paper's, and which has `coefficient` [N s²] in the unit of the column.
    fn stopped(rate: f64, coefficient: f64) -> Option<Stops> {
        let paper = Model::paper();
        let time: Vec<f64> = (0..1000).map(|row| 0.02 * f64::from(row)).collect();
        let command: Vec<f64> = (0..1000).map(|row| 0.3 + 0.1 * f64::from(row / 50 % 5)).collect();
        let rates: Vec<f64> = command.iter().map(|command| rate * paper.steady_rate(*command)).collect();
        let thrusts = rates.iter().map(|rate| coefficient * rate * rate).collect();
        let log = Dataset::made(
            time,
            [("command_1", command), ("propeller_rate_1_rad_s", rates), ("thrust_1_n", thrusts)],
        );
        let log = ScreenedLog::of(&log);
        check(log.rotor(1).expect("a rotor").data(), &paper).map(|it| it.stops)
    }

    #[test]
    fn a_unit_stops_whom_it_can_be_no_other_propeller_for() {
        let (own, grams) = (Model::paper().actuator.thrust_coefficient, 1e3 / STANDARD_GRAVITY);
        assert_eq!(stopped(1.0, own), None);
        // The model's rotor, in other units.
        assert_eq!(stopped(1.0, grams * own), Some(Stops::Fits));
        assert_eq!(stopped(0.85, grams * own), Some(Stops::Fits));
        assert_eq!(stopped(1.0, 1e3 * own), Some(Stops::Fits));
        assert_eq!(stopped(1.0, grams / 1e3 * own), Some(Stops::Searches));
        // A racing propeller of a tenth of the model's coefficient, whose tips would pass the speed of sound.
        assert_eq!(stopped(2.2, 1.4e-6), None);
        assert_eq!(stopped(2.2, grams * 1.4e-6), Some(Stops::Fits));
        // Rates in rpm beside right thrusts: their tips would be as fast.
        assert_eq!(stopped(7.2, 9.0 / 7.2_f64.powi(2) * own), Some(Stops::Nobody));
        assert_eq!(stopped(13.4, 8.4 / 13.4_f64.powi(2) * own), Some(Stops::Nobody));
        // A propeller of 0.8 m under a slow motor pushes a hundred times as hard at each rate.
        assert_eq!(stopped(0.5, grams * own), Some(Stops::Nobody));
    }
}
