//! Voltages that no battery of such a bench has.

use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// A voltage in millivolts, tenths of a volt, or a charge in percent.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let (low, high) = rotor.voltage.as_deref().map(bounds)?;
    let is_impossible = high > THRESHOLDS.impossible_voltage;
    let finding = rotor.finding("battery_voltage_too_high").with("least_v", low).with("greatest_v", high);
    let finding = finding.with("unit", if is_impossible { "mV" } else { "" });
    (high >= THRESHOLDS.high_voltage).then_some(Suspicion::impossible_if(is_impossible, finding))
}
