//! Zeros of a rotor's rate that are no measurement: its telemetry dropped out.

use std::ops::Range;

use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::{median, quantile};
use crate::screening::channel::{CheckedChannel, Judgement};
use crate::screening::rotor_data::{LEAST_COMMAND, held};
use crate::screening::thresholds::THRESHOLDS;

/// The code: a rate of exactly zero although the rotor was commanded to turn.
pub const RATE_DROPOUT: &str = "rate_dropout";

/// Zeros of a rotor's rate that are no measurement.
pub(crate) fn check(channel: &CheckedChannel) -> Option<Judgement> {
    let command = channel.command.filter(|_| channel.is_rotor_rate())?;
    let (time, segments) = (channel.log.time(), channel.log.segments());
    let (command, rate) = (held(command, &segments), channel.left());
    let rows: Vec<usize> =
        segments.iter().flat_map(|segment| zeros_of(time, &command, &rate, segment)).collect();
    let finding = channel.finding(RATE_DROPOUT).with("first_s", time[*rows.first()?]);
    Some(Judgement::new(finding, rows))
}

/// Rows of a segment that read zero although the rotor turned, or should have.
fn zeros_of(time: &[f64], command: &[f64], rate: &[f64], segment: &Range<usize>) -> Vec<usize> {
    let middle = middle(rate);
    let is_started = started(time, command, segment);
    let known: Vec<usize> = finite_rows(rate, segment.clone());
    let turns = |at: Option<usize>| {
        at.and_then(|at| known.get(at))
            .is_some_and(|row| rate[*row].abs() > THRESHOLDS.dropout_neighbour * middle)
    };
    let mut zeros = Vec::new();
    let mut at = 0;
    while at < known.len() {
        let count = known[at..].iter().take_while(|row| rate[**row] == 0.0).count();
        let rows = &known[at..at + count];
        let is_commanded = |row: &&usize| command[**row] >= LEAST_COMMAND;
        let is_between = turns(at.checked_sub(1)) && turns(Some(at + count));
        let is_short = (1..=THRESHOLDS.dropout_isolated).contains(&count)
            && rows.iter().all(|row| is_commanded(&row))
            && is_between;
        // Before the first frame of a telemetry that starts after the log the rotor turned as behind it.
        let is_first = at == 0 && rows.iter().all(|row| command[*row] >= THRESHOLDS.dropout_turns);
        let is_missed = is_first && is_up(time, rate, &known[count..]);
        // Once it must have started and has not, it was not measured from the beginning.
        let was_measured = || is_standstill(time, rate, [&known[..at], &known[at + count..]]);
        let has_started = rows.iter().any(|row| is_started[*row - segment.start]);
        if is_short || is_missed || has_started && !was_measured() {
            zeros.extend(rows.iter().filter(is_commanded));
        }
        at += count.max(1);
    }
    zeros
}

/// Whether the first of these rows reads what a rotor reads that turned before: one that starts climbs from near zero, and
/// has got far when as little time is over as this looks away from.
fn is_up(time: &[f64], rate: &[f64], rows: &[usize]) -> bool {
    rows.first()
        .zip(reached(time, rate, rows.iter()))
        .is_some_and(|(first, low)| rate[*first].abs() >= THRESHOLDS.dropout_at_once * low)
}

/// [rad/s] what is read at the least some way from the first of these rows, where a rotor that began to turn there has got far.
fn reached<'a>(time: &[f64], rate: &[f64], rows: impl Iterator<Item = &'a usize>) -> Option<f64> {
    let mut rows = rows.peekable();
    let first = time[**rows.peek()?];
    let ages = rows.map(|row| ((time[*row] - first).abs(), rate[*row].abs()));
    let within = ages.take_while(|(age, _)| *age < THRESHOLDS.dropout_started);
    let far = within.filter(|(age, size)| *age >= THRESHOLDS.dropout_got_far && *size > 0.0);
    quantile(far.map(|(_, size)| size), THRESHOLDS.dropout_low)
}

/// Whether a standstill between these rows was a true one: the rotor came to rest before it, or begins to turn behind it, by readings
/// below what it has elsewhere.
fn is_standstill(time: &[f64], rate: &[f64], [before, behind]: [&[usize]; 2]) -> bool {
    let least =
        quantile(rate.iter().map(|rate| rate.abs()).filter(|size| *size > 0.0), THRESHOLDS.dropout_low);
    let is_part = |row: Option<&usize>, reached: Option<f64>| {
        let part = |of: Option<f64>| {
            row.zip(of).is_some_and(|(row, of)| rate[*row].abs() < THRESHOLDS.dropout_at_once * of)
        };
        part(reached) && part(least)
    };
    is_part(before.last(), reached(time, rate, before.iter().rev()))
        || is_part(behind.first(), reached(time, rate, behind.iter()))
}

/// Where in a segment a rotor has been commanded to turn for so long that it does.
fn started(time: &[f64], command: &[f64], segment: &Range<usize>) -> Vec<bool> {
    let mut since = None;
    let is_started = segment.clone().map(|row| {
        since = (command[row] >= THRESHOLDS.dropout_turns).then(|| since.unwrap_or(time[row]));
        since.is_some_and(|since| time[row] - since >= THRESHOLDS.dropout_started)
    });
    is_started.collect()
}

/// [rad/s] the median of what is not zero.
fn middle(rate: &[f64]) -> f64 {
    median(rate.iter().map(|rate| rate.abs()).filter(|size| *size > 0.0)).unwrap_or(0.0)
}
