//! A battery that has more than the model's has when full.

use super::battery_in_other_unit;
use crate::estimation::quantile::median;
use crate::model::Model;
use crate::screening::rotor_data::RotorLog;
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// Says so, where it is not the unit.
pub(crate) fn check(rotor: &RotorLog, model: &Model) -> Option<Suspicion> {
    let (middle, full) = (median(rotor.voltage.as_ref()?.iter().copied())?, model.actuator.full_voltage);
    let is_other = middle > THRESHOLDS.other_battery_noted * full && model.actuator.voltage_gain != 0.0;
    let finding = rotor.finding("battery_of_other_bench").with("voltage_v", middle);
    (is_other && battery_in_other_unit::check(rotor, model).is_none())
        .then(|| Suspicion::said(finding.with("full_voltage_v", full)))
}
