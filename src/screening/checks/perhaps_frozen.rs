//! A reading that repeats one value for longer than its own motion explains, where nothing can be asked whether what it measures moved
//! meanwhile: a battery, a current, a thrust. Of a rate beside its command `rate_frozen` asks, and its is the word. Of a gyro
//! `gyro_frozen` asks, and leaves open what a body may do: rest at zero, or turn evenly. That is in doubt where the angle, or what
//! turns the body, moves meanwhile; where they stand, the body may stand as well.

use std::ops::Range;

use super::gyro_frozen::{self, GYRO_FROZEN};
use crate::log::signals::rotor_of;
use crate::screening::column::{CheckedColumn, Remark};
use crate::screening::equal_runs::{smallest_step, too_long};
use crate::screening::thresholds::THRESHOLDS;
use crate::signal::columns::{self, BATTERY_VOLTAGE, BODY_RATE};

/// The code: one value for longer than the channel's motion explains.
pub const PERHAPS_FROZEN: &str = "perhaps_frozen";

/// Runs of equal values that are too long for the column. A rotor that stands still reads zero, rightly.
pub(crate) fn check(column: &CheckedColumn) -> Vec<Remark> {
    let values: Vec<f64> = column.present.iter().map(|row| column.values[*row]).collect();
    if column.name == BODY_RATE {
        return of_gyro(column, &values);
    }
    if !column.is_moving_reading() || is_asked_elsewhere(column) {
        return Vec::new();
    }
    let stands = |value: f64| is_rate(column) && value == 0.0;
    let found = too_long(&values);
    let found = if column.name == BATTERY_VOLTAGE { without_plateaus(&values, found) } else { found };
    let runs = found.into_iter().filter(|run| !stands(values[run.start]));
    remark(column, runs)
}

fn remark(column: &CheckedColumn, runs: impl Iterator<Item = Range<usize>>) -> Vec<Remark> {
    let stretch = |run: Range<usize>| column.stretch(column.present[run.start], column.present[run.end - 1]);
    column.remark(PERHAPS_FROZEN, runs.map(stretch).collect())
}

/// The same of a gyro, all of the log where it never moves, as far as the body does.
fn of_gyro(column: &CheckedColumn, values: &[f64]) -> Vec<Remark> {
    let found =
        if column.is_constant() { std::iter::once(0..values.len()).collect() } else { too_long(values) };
    let known = column.judgement(&[GYRO_FROZEN]).map_or(&[][..], |judged| &judged.rows);
    let rows = |run: &Range<usize>| &column.present[run.clone()];
    let is_known = |run: &Range<usize>| rows(run).iter().any(|row| known.binary_search(row).is_ok());
    let moves = |run: &Range<usize>| gyro_frozen::body_may_move(column.log, rows(run));
    remark(column, found.into_iter().filter(|run| !is_known(run) && moves(run)))
}

fn is_rate(column: &CheckedColumn) -> bool {
    columns::is_propeller_rate(column.name)
}

fn is_asked_elsewhere(column: &CheckedColumn) -> bool {
    let command = || rotor_of(column.name).and_then(|rotor| column.log.column(&columns::command(rotor)));
    is_rate(column) && command().is_some()
}

/// The runs of equal values that a reading did not just go on from: a battery that is read in steps stands on each. At the
/// end of the log one that is no longer than others were will have gone on, too.
fn without_plateaus(values: &[f64], runs: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let step = smallest_step(values);
    let goes_on = |run: &Range<usize>| {
        values
            .get(run.end)
            .is_some_and(|next| (next - values[run.start]).abs() <= THRESHOLDS.battery_step * step)
    };
    let longest = runs.iter().filter(|run| goes_on(run)).map(Range::len).max().unwrap_or(0);
    let is_last = |run: &Range<usize>| {
        run.end == values.len() && run.len() <= THRESHOLDS.battery_last_plateau * longest
    };
    runs.into_iter().filter(|run| !goes_on(run) && !is_last(run)).collect()
}
