//! Readings of a battery that no battery has which turns rotors: zeros of a telemetry that dropped out, or its greatest number.

use crate::estimation::quantile::median;
use crate::screening::channel::{CheckedChannel, Judgement};
use crate::screening::thresholds::THRESHOLDS;

/// The code: readings that no battery has which turns a rotor.
pub const BATTERY_DROPOUT: &str = "battery_dropout";
/// [V] no battery that turns a rotor has less.
pub const EMPTY: f64 = THRESHOLDS.least_battery;

/// Readings below [`EMPTY`], or far above all others, beside more that are neither; `None` too where most are such.
pub(crate) fn check(channel: &CheckedChannel) -> Option<Judgement> {
    if !channel.is_battery() {
        return None;
    }
    let volts = channel.values;
    let middle = median(volts.iter().copied())?;
    let is_none = |row: &usize| volts[*row] < EMPTY || volts[*row] > THRESHOLDS.overfull_battery * middle;
    let rows: Vec<usize> = (0..volts.len()).filter(is_none).collect();
    let finding = channel
        .finding(BATTERY_DROPOUT)
        .with("middle_v", middle)
        .with("least_v", EMPTY)
        .with("most_v", THRESHOLDS.overfull_battery * middle);
    (!rows.is_empty() && middle >= EMPTY).then(|| Judgement::new(finding, rows))
}
