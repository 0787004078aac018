//! A battery's reading that no battery has which turns a rotor: it is not connected, or another column.

use super::battery_dropout::EMPTY;
use crate::estimation::quantile::median;
use crate::screening::battery::CheckedBattery;
use crate::screening::channel::Judgement;
use crate::screening::rotor_data::bounds;

/// All readings, where the middle one is none of a battery.
pub(crate) fn check(battery: &CheckedBattery) -> Option<Judgement> {
    let voltage = battery.turning.iter().find_map(|rotor| rotor.voltage.as_deref())?;
    let (low, high) = bounds(voltage);
    let finding = battery.finding("battery_not_connected").with("least_v", low).with("greatest_v", high);
    median(voltage.iter().copied())
        .is_none_or(|volts| volts < EMPTY)
        .then(|| Judgement::new(finding, battery.rows()))
}
