//! A rotor that stands although it is commanded to turn: it stalled, its speed controller lost it, or it would not start. Its zeros are
//! measurements, and no evidence of g(u) or of the pole; nor is how it fell and how it came up again.
//!
//! A dead zone is another thing: there the rotor stands under every command as small. So the log itself must say otherwise: under a
//! command as small it turned elsewhere, or the command is one that turns every rotor.

use std::collections::VecDeque;
use std::ops::Range;

use crate::screening::channel::Judgement;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::{LEAST_COMMAND, RotorLog, bounds};
use crate::screening::thresholds::THRESHOLDS;

/// The code: a rotor that stood while it was commanded to turn.
pub const STALLED: &str = "stalled";

/// Takes a stalled rotor out of the score, from where it began to fall until it has started again.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    let stalls = stalls(rotor);
    let data = &mut rotor.data;
    let longest = stalls.iter().max_by(|a, b| span(data, a).total_cmp(&span(data, b)))?;
    let commands = bounds(&data.command[longest.clone()]);
    let finding = data.finding(STALLED).with("places", stalls.len());
    let finding = finding.with("from_s", data.time[longest.start]).with("to_s", data.time[longest.end - 1]);
    let finding = finding.with("least_command", commands.0).with("greatest_command", commands.1);
    let finding = finding.with("starting_s", THRESHOLDS.starting);
    let rests: Vec<usize> = stalls.iter().flat_map(|rows| without_law(data, rotor.measured, rows)).collect();
    let rows: Vec<usize> = rests.iter().copied().filter(|row| data.rate[*row].is_finite()).collect();
    rows.iter().for_each(|row| data.rate[*row] = f64::NAN);
    rotor.at_rest.extend(rests);
    rotor.at_rest.sort_unstable();
    rotor.at_rest.dedup();
    (!rows.is_empty()).then(|| Judgement::new(finding, rows))
}

fn span(data: &RotorLog, rows: &Range<usize>) -> f64 {
    data.time[rows.end - 1] - data.time[rows.start]
}

/// Rows over which it stands under commands that should turn it, for longer than any rotor needs to start.
fn stalls(rotor: &CheckedRotor) -> Vec<Range<usize>> {
    let (data, rate) = (&rotor.data, rotor.measured);
    let greatest = bounds(rate).1;
    let whole = data.whole();
    let mut at_rest = rotor.at_rest.iter().copied().peekable();
    let mut stands = |row: usize| {
        while at_rest.next_if(|rests| *rests < row).is_some() {}
        at_rest.peek() != Some(&row)
            && rate[row].abs() <= THRESHOLDS.stall_share * greatest
            && data.command[row] >= LEAST_COMMAND
    };
    let mut found: Vec<Range<usize>> = Vec::new();
    for segment in whole.iter().filter(|_| greatest > 0.0) {
        let known: Vec<usize> =
            segment.clone().filter(|row| rate.get(*row).is_some_and(|it| it.is_finite())).collect();
        let known: Vec<(usize, bool)> = known.into_iter().map(|row| (row, stands(row))).collect();
        let runs = known.chunk_by(|a, b| a.1 == b.1).filter(|rows| rows[0].1);
        found.extend(runs.map(|rows| rows[0].0..rows[rows.len() - 1].0 + 1));
    }
    found.retain(|rows| span(data, rows) >= THRESHOLDS.dropout_started);
    if found.is_empty() {
        return found;
    }
    let turned = least_turning_command(data, rate, &whole, THRESHOLDS.standing_share * greatest);
    found.retain(|rows| {
        let most = bounds(&data.command[rows.clone()]).1;
        most >= turned - THRESHOLDS.command_same || must_turn(data, rows)
    });
    found
}

/// [-] The least command under which, and under smaller ones, the rotor turned for so long that it did not merely run out; infinite
/// where there is none.
fn least_turning_command(data: &RotorLog, rate: &[f64], whole: &[Range<usize>], standing: f64) -> f64 {
    let mut least = f64::INFINITY;
    for segment in whole {
        let mut since = None;
        // Commands of the last seconds, descending: the first is the greatest.
        let mut greatest: VecDeque<usize> = VecDeque::new();
        for row in segment.clone().filter(|row| rate[*row].is_finite()) {
            if rate[row] <= standing {
                since = None;
                greatest.clear();
                continue;
            }
            let from = *since.get_or_insert(data.time[row]);
            while greatest.back().is_some_and(|last| data.command[*last] <= data.command[row]) {
                greatest.pop_back();
            }
            greatest.push_back(row);
            let begins = data.time[row] - THRESHOLDS.dropout_started;
            while greatest.front().is_some_and(|first| data.time[*first] < begins) {
                greatest.pop_front();
            }
            if from <= begins {
                least = least.min(greatest.front().map_or(f64::INFINITY, |row| data.command[*row]));
            }
        }
    }
    least
}

/// Whether it is commanded, for as long as any rotor needs to start, what turns every rotor.
fn must_turn(data: &RotorLog, rows: &Range<usize>) -> bool {
    let mut since = None;
    rows.clone().any(|row| {
        since = (data.command[row] >= THRESHOLDS.dropout_turns).then(|| since.unwrap_or(data.time[row]));
        since.is_some_and(|since| data.time[row] - since >= THRESHOLDS.dropout_started)
    })
}

/// A stall, how the rotor came to it and how it started behind it.
fn without_law(data: &RotorLog, rate: &[f64], stall: &Range<usize>) -> Range<usize> {
    let whole = data.whole();
    let within = whole.iter().find(|rows| rows.contains(&stall.start)).cloned().unwrap_or(stall.clone());
    let pause = THRESHOLDS.stall_pause.max(2.0 * data.interval);
    let (mut begin, mut peak) = (stall.start, rate[stall.start]);
    for row in (within.start..stall.start).rev().filter(|row| rate[*row].is_finite()) {
        let is_over = data.time[begin] - data.time[row] > pause;
        if is_over || data.time[stall.start] - data.time[row] > THRESHOLDS.dropout_started {
            break;
        }
        if rate[row] > peak {
            (begin, peak) = (row, rate[row]);
        }
    }
    let started = data.time[stall.end - 1] + THRESHOLDS.starting;
    let end = (stall.end..within.end).find(|row| data.time[*row] > started).unwrap_or(within.end);
    begin..end
}
