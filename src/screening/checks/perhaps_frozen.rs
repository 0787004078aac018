//! A reading that repeats one value for longer than its own motion explains, where nothing can be asked whether what it measures moved
//! meanwhile: a battery, a current, a thrust. Of a rate beside its command, and of a gyro beside an angle or what turns the body,
//! `rate_frozen` and `frozen_gyro` ask, and theirs is the word.

use std::ops::Range;

use super::frozen_gyro;
use crate::log::dataset::rotor_of;
use crate::screening::channel::{BATTERY, BODY_RATE};
use crate::screening::column::{Column, Remark};
use crate::screening::equal_runs::{smallest_step, too_long};
use crate::screening::thresholds::THRESHOLDS;

/// The code: one value for longer than the channel's motion explains.
pub const PERHAPS_FROZEN: &str = "perhaps_frozen";

/// Runs of equal values that are too long for the column. A rotor that stands still reads zero, rightly.
pub(crate) fn check(column: &Column) -> Vec<Remark> {
    if !column.is_moving_reading() || is_asked_elsewhere(column) {
        return Vec::new();
    }
    let values: Vec<f64> = column.present.iter().map(|row| column.values[*row]).collect();
    let stands = |value: f64| is_rate(column) && value == 0.0;
    let found = too_long(&values);
    let found = if column.name == BATTERY { without_treads(&values, found) } else { found };
    let runs = found.into_iter().filter(|run| !stands(values[run.start]));
    let stretch = |run: Range<usize>| column.stretch(column.present[run.start], column.present[run.end - 1]);
    column.remark(PERHAPS_FROZEN, runs.map(stretch).collect())
}

fn is_rate(column: &Column) -> bool {
    column.name.starts_with("propeller_rate")
}

fn is_asked_elsewhere(column: &Column) -> bool {
    let command = || rotor_of(column.name).and_then(|rotor| column.log.column(&format!("command_{rotor}")));
    is_rate(column) && command().is_some() || column.name == BODY_RATE && frozen_gyro::can_ask(column.log)
}

/// The runs of equal values that a reading did not just go on from: a battery that is read in steps stands on each. At the
/// end of the log one that is no longer than others were will have gone on, too.
fn without_treads(values: &[f64], runs: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let step = smallest_step(values);
    let goes_on = |run: &Range<usize>| {
        values
            .get(run.end)
            .is_some_and(|next| (next - values[run.start]).abs() <= THRESHOLDS.battery_step * step)
    };
    let longest = runs.iter().filter(|run| goes_on(run)).map(Range::len).max().unwrap_or(0);
    let is_last =
        |run: &Range<usize>| run.end == values.len() && run.len() <= THRESHOLDS.battery_last_tread * longest;
    runs.into_iter().filter(|run| !goes_on(run) && !is_last(run)).collect()
}
