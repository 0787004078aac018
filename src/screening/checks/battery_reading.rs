//! A battery's reading as a whole: whether it is one at all, and for how long it is not read. Its single cells are judged in
//! `battery_range`.

use super::battery_range::EMPTY;
use super::saturation;
use crate::estimation::quantile::median;
use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::channel::{BATTERY, Judgement};
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::thresholds::THRESHOLDS;

/// What is wrong with the whole reading, by the rotors that turn: then none of it is a measurement, for what a battery that is
/// not connected or saturated had is not known anywhere.
pub(crate) fn useless<'a>(log: &Dataset, turning: impl Iterator<Item = &'a RotorLog>) -> Option<Judgement> {
    let readings = log.column(BATTERY)?;
    let finding = |code| Finding::new(code, BATTERY).of(log.source_name());
    let rows: Vec<usize> = (0..readings.len()).filter(|row| readings[*row].is_finite()).collect();
    for rotor in turning {
        let Some(voltage) = rotor.voltage.as_deref() else { continue };
        let (low, high) = bounds(voltage);
        if median(voltage.iter().copied()).is_none_or(|volts| volts < EMPTY) {
            let finding = finding("battery_not_connected").with("least_v", low).with("greatest_v", high);
            return Some(Judgement::new(finding, rows));
        }
        if let Some(saturated) = saturation::find(voltage, Some(&rotor.command)) {
            let finding = finding("battery_saturated").rows(saturated.rows.len());
            let finding = finding.with("readings", saturated.of).with("at", saturated.at);
            return Some(Judgement { finding, rows, biased: Vec::new() });
        }
    }
    None
}

/// The longest time without a reading of a battery that moves, where that is long: it is held meanwhile, and the battery went
/// on. A model needs some voltage there, and the rotor's rate is measured all the same.
pub(crate) fn gap<'a>(log: &Dataset, mut turning: impl Iterator<Item = &'a RotorLog>) -> Option<Judgement> {
    let rotor = turning.next()?;
    let (low, high) = bounds(rotor.voltage.as_deref()?);
    let (from, to) = rotor.voltage_gap.filter(|(from, to)| to - from > THRESHOLDS.battery_gap)?;
    let finding = Finding::new("battery_reading_gap", BATTERY).of(log.source_name());
    let finding = finding.with("from_s", from).with("to_s", to);
    (low < high).then(|| Judgement::new(finding, Vec::new()))
}
