//! A battery that is not read for a while, and went on.

use crate::screening::battery::CheckedBattery;
use crate::screening::channel::Judgement;
use crate::screening::rotor_data::bounds;
use crate::screening::thresholds::THRESHOLDS;

/// The longest time without a reading of a battery that moves, where that is long: it is held meanwhile, and the battery went
/// on. A model needs some voltage there, and the rotor's rate is measured all the same.
pub(crate) fn check(battery: &CheckedBattery) -> Option<Judgement> {
    let rotor = battery.turning.first()?;
    let (low, high) = bounds(rotor.voltage.as_deref()?);
    let (from, to) = rotor.voltage_gap.filter(|(from, to)| to - from > THRESHOLDS.battery_gap)?;
    let finding = battery.finding("battery_reading_gap").with("from_s", from).with("to_s", to);
    (low < high).then(|| Judgement::new(finding, Vec::new()))
}
