//! A rotor that stands although it is commanded to turn: it stalled, its speed controller lost it, or it would not start. Its zeros are
//! measurements, and no evidence of g(u) or of the pole; nor is how it fell and how it came up again.
//!
//! A dead zone is another thing: there the rotor stands under every command as small. So the log itself must say otherwise: under
//! commands as small it turned elsewhere.

use std::collections::VecDeque;
use std::ops::Range;

use crate::estimation::finite::finite_rows;
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
    // Behind the command that it answers at last it still stands for a moment.
    let begins = data.time[longest.end - 1] - THRESHOLDS.starting;
    let stood = longest.clone().take_while(|row| data.time[*row] <= begins);
    let commands = bounds(&stood.map(|row| data.command[row]).collect::<Vec<f64>>());
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
        let known: Vec<usize> = finite_rows(rate, segment.clone());
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
        let known: Vec<usize> = finite_rows(rate, rows.clone());
        let most = extremes(data, &known, |command, last| command <= last).fold(0.0, f64::max);
        most >= turned - THRESHOLDS.command_same
    });
    found
}

/// [-] The least command under which, and under smaller ones, the rotor turned for so long that it did not merely run out; infinite
/// where there is none.
fn least_turning_command(data: &RotorLog, rate: &[f64], whole: &[Range<usize>], standing: f64) -> f64 {
    let mut least = f64::INFINITY;
    for segment in whole {
        let known: Vec<usize> = finite_rows(rate, segment.clone());
        for turning in known.chunk_by(|a, b| (rate[*a] > standing) == (rate[*b] > standing)) {
            if rate[turning[0]] > standing {
                least = extremes(data, turning, |command, last| command >= last).fold(least, f64::min);
            }
        }
    }
    least
}

/// [-] The command that goes beyond all others of as long as any rotor needs to start or to run out, for each such time that ends
/// with one of these rows.
fn extremes<'a>(
    data: &'a RotorLog,
    rows: &'a [usize],
    is_beyond: impl Fn(f64, f64) -> bool + 'a,
) -> impl Iterator<Item = f64> + 'a {
    // Commands of the last seconds: the first is beyond the others.
    let mut beyond: VecDeque<usize> = VecDeque::new();
    rows.iter().filter_map(move |row| {
        while beyond.back().is_some_and(|last| is_beyond(data.command[*row], data.command[*last])) {
            beyond.pop_back();
        }
        beyond.push_back(*row);
        let begins = data.time[*row] - THRESHOLDS.dropout_started;
        while beyond.front().is_some_and(|first| data.time[*first] < begins) {
            beyond.pop_front();
        }
        let first = beyond.front().filter(|_| data.time[rows[0]] <= begins)?;
        Some(data.command[*first])
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
