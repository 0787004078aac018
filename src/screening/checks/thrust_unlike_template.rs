//! Thrusts that are those of another unit, by what the model's rotor does at the same commands.

use crate::model::Model;
use crate::screening::plausibility::{is_another, nearest};
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;
use crate::unit::STANDARD_GRAVITY;

/// Units that a thrust may have been written in and that are far from 1 N, and what they say for 1 N.
const UNITS: [(&str, f64); 3] =
    [("gf", 1e3 / STANDARD_GRAVITY), ("kgf", 1.0 / STANDARD_GRAVITY), ("mN", 1e3)];

/// Units nearer to 1 N. Another propeller's thrusts are as near: they are asked for only within a share of what they would say, and
/// where the rates are the model's within as much.
const NEAR_UNITS: [(&str, f64); 2] =
    [("lbf", 1.0 / 4.448_221_615_260_5), ("ozf", 16.0 / 4.448_221_615_260_5)];

/// Thrusts that are many times the model's, or few of it, and the unit that would say so. What is below zero has the wrong
/// sign, which is found where the curve is fitted.
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
        None if is_another(&ratio, THRESHOLDS.another_thrust_unit) => nearest(&UNITS, ratio),
        None => return None,
    };
    let (least, most) = bounds(thrust);
    let finding = rotor.finding("thrust_unlike_template").with("least", least).with("greatest", most);
    Some(Suspicion::said(finding.with("ratio", ratio).with("unit", unit.unwrap_or_default())))
}
