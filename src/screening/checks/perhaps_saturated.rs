//! A reading that piles up at an end of its range and does not come there often enough to be sure: else it is `saturated`.

use super::battery_saturated::BATTERY_SATURATED;
use super::saturated::{self, SATURATED, piles};
use crate::screening::column::{CheckedColumn, Remark};
use crate::signal::columns::{BATTERY_VOLTAGE, COMMANDS};

/// The code: a channel that piles up at one value.
pub const PERHAPS_SATURATED: &str = "perhaps_saturated";

/// The ends. A battery settles at levels, too, which is asked of its reading.
pub(crate) fn check(column: &CheckedColumn) -> Vec<Remark> {
    if !column.is_moving_reading() || column.judgement(&[SATURATED, BATTERY_SATURATED]).is_some() {
        return Vec::new();
    }
    let mut ends = piles(&column.sorted);
    if column.name == BATTERY_VOLTAGE && !ends.is_empty() {
        let command = column.log.column(COMMANDS[0]).or(column.log.column(COMMANDS[1]));
        let found = saturated::find(&column.values, command);
        ends.retain(|end| found.as_ref().is_some_and(|found| found.at.contains(&end.at)));
    }
    let remark = |end: saturated::Saturation| Remark {
        finding: column.finding(PERHAPS_SATURATED).with("at", end.at).with("samples", end.samples),
        stretches: Vec::new(),
    };
    ends.into_iter().map(remark).collect()
}
