//! Stretches without a value, where the log itself has rows.

use std::collections::BTreeSet;

use crate::screening::column::{CheckedColumn, Remark};
use crate::screening::thresholds::THRESHOLDS;

/// The code: cells without a value for longer than the column's pace explains.
pub const DROPOUTS: &str = "dropouts";

/// Stretches between two values that are too long for the column, holes in time apart.
pub(crate) fn check(column: &CheckedColumn) -> Vec<Remark> {
    let time = column.log.time();
    let hole_after: BTreeSet<usize> = column.log.holes().iter().map(|hole| hole.after).collect();
    let is_dropout = |pair: &&[usize]| {
        time[pair[1]] - time[pair[0]] > THRESHOLDS.gap_factor * column.interval
            && pair[1] > pair[0] + 1
            && hole_after.range(pair[0]..pair[1]).next().is_none()
    };
    let found = column.present.windows(2).filter(is_dropout);
    column.remark(DROPOUTS, found.map(|pair| column.stretch(pair[0], pair[1])).collect())
}
