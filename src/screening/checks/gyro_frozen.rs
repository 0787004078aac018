//! A frozen gyroscope: the same reading for far longer than this one ever repeats itself.
//!
//! Of a rotor its command has to be asked, too, which is for who knows what it does. A body may rest: at zero it does, and
//! where its angle stands as well. Without an angle it is asked whether what turns it came and went meanwhile, while it
//! elsewhere moves the reading in as short a time.

use std::ops::Range;

use super::saturated::SATURATED;
use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::median;
use crate::log::dataset::Dataset;
use crate::screening::channel::{CheckedChannel, Judgement};
use crate::screening::equal_runs::{smallest_step, too_long};
use crate::screening::thresholds::THRESHOLDS;
use crate::signal::columns::{self, BODY_ANGLE, BODY_RATE, COMMANDS, TORQUE_COMMAND};

/// The code: a gyroscope that stood still to the last digit.
pub const GYRO_FROZEN: &str = "gyro_frozen";

/// Readings of the gyroscope that were not measured.
pub(crate) fn check(channel: &CheckedChannel) -> Option<Judgement> {
    if channel.name != BODY_RATE {
        return None;
    }
    let log = channel.log;
    // What a logger held may be frozen as well.
    let values = channel.without(|code| code == SATURATED);
    let known: Vec<usize> = finite_rows(&values, 0..values.len());
    let readings: Vec<f64> = known.iter().map(|row| values[*row]).collect();
    let found = too_long(&readings).into_iter().filter(|run| readings[run.start] != 0.0);
    let is_frozen = |run: &Range<usize>| match log.column(BODY_ANGLE) {
        Some(angle) => !rests(angle, &known[run.clone()]),
        None => is_driven(log, &known[run.clone()]) && moves_elsewhere(&readings, run.len()),
    };
    let runs: Vec<&[usize]> = found.filter(is_frozen).map(|run| &known[run]).collect();
    let longest = runs.iter().max_by_key(|run| run.len())?;
    let (from, to) = (longest[0], longest[longest.len() - 1]);
    // The first of them was a measurement.
    let rows: Vec<usize> = runs.iter().flat_map(|run| &run[1..]).copied().collect();
    let finding = channel
        .finding(GYRO_FROZEN)
        .with("places", runs.len())
        .with("from_s", log.time()[from])
        .with("to_s", log.time()[to])
        .with("value", values[from]);
    Some(Judgement::new(finding, rows))
}

/// Whether the body's angle moves over these rows, or, where none is measured or it never moves, a command, a torque or a rotor: what
/// the body may have followed. Where the log has none of them nothing can be asked, and it may.
pub(super) fn body_may_move(log: &Dataset, rows: &[usize]) -> bool {
    if let Some(angle) = log.column(BODY_ANGLE).filter(|angle| range(angle.iter().copied()) > 0.0) {
        return !rests(angle, rows);
    }
    let is_drive = |name: &&str| name.contains("command") || columns::is_propeller_rate(name);
    let mut drives = log.names().filter(is_drive).filter_map(|name| log.column(name)).peekable();
    let moves = |drive: &[f64]| {
        let all = range(drive.iter().copied());
        all > 0.0 && range(rows.iter().map(|row| drive[*row])) >= THRESHOLDS.frozen_drive_share * all
    };
    drives.peek().is_none() || drives.any(moves)
}

/// Greatest less least of what is finite.
pub(super) fn range(values: impl Iterator<Item = f64>) -> f64 {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let finite = values.filter(|value| value.is_finite());
    let (low, high) = finite.fold(ends, |(low, high), value| (low.min(value), high.max(value)));
    high - low
}

/// Whether the body's angle stands over these rows, too.
fn rests(angle: &[f64], rows: &[usize]) -> bool {
    range(rows.iter().map(|row| angle[*row])) < THRESHOLDS.frozen_angle_moves * range(angle.iter().copied())
}

/// Whether what turns the body comes and goes over these rows.
fn is_driven(log: &Dataset, rows: &[usize]) -> bool {
    let Some(drive) = drive(log) else { return false };
    let moves = THRESHOLDS.frozen_drive_share * range(drive.iter().copied());
    let mut driven = rows.iter().map(|row| drive[*row]).filter(|value| value.is_finite());
    let Some(mut last) = driven.next() else { return false };
    let mut changes = 0;
    for value in driven.filter(|_| moves > 0.0) {
        if (value - last).abs() >= moves {
            (changes, last) = (changes + 1, value);
        }
    }
    changes >= THRESHOLDS.frozen_drive_changes
}

/// What turns the body, up to a factor: a torque, or the one rotor's command less the other's; of one rotor its own.
pub(super) fn drive(log: &Dataset) -> Option<Vec<f64>> {
    if let Some(torque) = log.column(TORQUE_COMMAND) {
        return Some(torque.to_vec());
    }
    match (log.column(COMMANDS[0]), log.column(COMMANDS[1])) {
        (Some(first), Some(second)) => Some(first.iter().zip(second).map(|(a, b)| a - b).collect()),
        (one, other) => one.or(other).map(<[f64]>::to_vec),
    }
}

/// Whether the reading usually moves by more than its own coarseness over as many rows as these.
fn moves_elsewhere(readings: &[f64], rows: usize) -> bool {
    let usual = median(readings.chunks_exact(rows).map(|rows| range(rows.iter().copied())));
    usual.is_some_and(|usual| usual >= THRESHOLDS.frozen_steps * smallest_step(readings))
}
