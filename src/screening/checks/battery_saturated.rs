//! A battery's reading that stands at the end of its range: what the battery had is not known.

use super::saturated;
use crate::screening::battery::CheckedBattery;
use crate::screening::channel::Judgement;

/// The code: a battery at the end of what is read of it.
pub const BATTERY_SATURATED: &str = "battery_saturated";

/// All readings, where some stand at an end and are not what the battery settles to under one rotor's command.
pub(crate) fn check(battery: &CheckedBattery) -> Option<Judgement> {
    let saturated = battery
        .turning
        .iter()
        .find_map(|rotor| saturated::find(rotor.voltage.as_deref()?, Some(&rotor.command)))?;
    let finding = battery.finding(BATTERY_SATURATED).rows(saturated.rows.len());
    let finding = finding.with("readings", saturated.of).with("at", saturated.at);
    Some(Judgement { finding, rows: battery.rows(), biased: Vec::new() })
}
