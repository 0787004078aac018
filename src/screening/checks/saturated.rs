//! Readings at the end of what a sensor or its link can carry: the value was at least that, and how much more is not known.
//!
//! Much may stand at an end of a channel's range: a level at which everything has settled, a body at rest, a coarse reading.
//! So it is asked whether the channel comes to that end again and again and stands still there, while it moves elsewhere.
//! What a coarse reading of a rotor settles to under one of its commands is not saturated, either.

use serde::Serialize;

use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::{median, sorted};
use crate::screening::channel::{CheckedChannel, Judgement};
use crate::screening::thresholds::THRESHOLDS;

/// A channel that piles up at its end.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Saturation {
    /// The value it does not pass.
    pub at: f64,
    /// Samples there.
    pub samples: usize,
}

/// Ends of the range at which far more samples stand than just inside.
pub(crate) fn piles(sorted: &[f64]) -> Vec<Saturation> {
    let levels: Vec<&[f64]> = sorted.chunk_by(|a, b| a == b).collect();
    if levels.len() < THRESHOLDS.saturated_levels {
        return Vec::new();
    }
    let ends = [(levels[0], levels[1]), (levels[levels.len() - 1], levels[levels.len() - 2])];
    // Nothing below zero is no end of a sensor: currents, thrusts and speeds of a rotor at rest pile up there.
    ends.into_iter()
        .filter(|(end, next)| {
            end.len() >= THRESHOLDS.saturated_least && end.len() > THRESHOLDS.saturated_factor * next.len()
        })
        .filter(|(end, _)| end[0] != 0.0)
        .map(|(end, _)| Saturation { at: end[0], samples: end.len() })
        .collect()
}

/// The code: readings at the end of what the sensor or its link can carry.
pub const SATURATED: &str = "saturated";

/// Readings of a channel at the ends of its range.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Saturated {
    /// Their rows, from 0.
    pub rows: Vec<usize>,
    /// Rows of the readings right before and behind those: that they are within the range is their noise's choice as much as
    /// the channel's, so they are biased.
    pub beside: Vec<usize>,
    /// Readings of the channel.
    pub of: usize,
    /// The ends, in the channel's unit, ascending.
    pub at: Vec<f64>,
}

/// Readings at the ends of the channel's range.
pub(crate) fn check(channel: &CheckedChannel) -> Option<Judgement> {
    if channel.is_battery() {
        return None;
    }
    let Saturated { rows, beside, of, at } = find(&channel.left(), channel.command)?;
    let finding = channel.finding(SATURATED).with("readings", of).with("at", at);
    Some(Judgement { biased: beside, ..Judgement::new(finding, rows) })
}

/// The saturated ones among the readings of a channel that are finite; `None` where there are none. `command` is what moves
/// it, where that is one rotor's and is known.
#[must_use]
pub(crate) fn find(values: &[f64], command: Option<&[f64]>) -> Option<Saturated> {
    let known: Vec<usize> = finite_rows(values, 0..values.len());
    let sorted = sorted(known.iter().map(|row| values[*row]));
    let piles = piles(&sorted);
    if piles.is_empty() {
        return None;
    }
    let pairs: Vec<[f64; 2]> = known.windows(2).map(|pair| [values[pair[0]], values[pair[1]]]).collect();
    let stands = |clip: &Saturation| {
        let (at_end, others): (Vec<[f64; 2]>, Vec<[f64; 2]>) =
            pairs.iter().partition(|[it, _]| *it == clip.at);
        let visits = known.chunk_by(|a, b| values[*a] == values[*b]);
        let visits = visits.filter(|visit| visit.len() > 1 && values[visit[0]] == clip.at).count();
        let step = |[it, next]: &[f64; 2]| (next - it).abs();
        let usual = median(others.iter().map(step).filter(|step| *step > 0.0)).unwrap_or(0.0);
        let comes = median(others.iter().filter(|[_, next]| *next == clip.at).map(step));
        let within = others.iter().filter(|[it, _]| piles.iter().all(|pile| *it != pile.at));
        let stay = [stay(&at_end), stay(&within.copied().collect::<Vec<_>>())];
        visits >= THRESHOLDS.saturated_visits
            && stay[0] >= THRESHOLDS.saturated_stands
            && stay[1] <= THRESHOLDS.saturated_stands_inside
            && comes.is_some_and(|comes| comes >= THRESHOLDS.saturated_comes * usual)
    };
    let is_approached = |clip: &Saturation| {
        command.is_some_and(|command| approaches_steadily(values, &known, &sorted, command, clip.at))
    };
    let at = piles.iter().filter(|clip| stands(clip) && !is_approached(clip)).map(|clip| clip.at);
    let at: Vec<f64> = at.collect();
    let rows: Vec<usize> = known.iter().copied().filter(|row| at.contains(&values[*row])).collect();
    let is_at_end = |row: &usize| at.contains(&values[*row]);
    let next_to_end = |pair: &[usize]| match [is_at_end(&pair[0]), is_at_end(&pair[1])] {
        [true, false] => Some(pair[1]),
        [false, true] => Some(pair[0]),
        _ => None,
    };
    let beside = known.windows(2).filter_map(next_to_end).collect();
    let of = known.len();
    (!rows.is_empty()).then_some(Saturated { rows, beside, of, at })
}

/// Whether a channel comes to an end of its range as what settles does that is read in steps: slowly, the last two steps of
/// the way are hardly more than that, and always under the same command. What is beyond an end is reached in full stride,
/// or under several commands.
fn approaches_steadily(values: &[f64], known: &[usize], sorted: &[f64], command: &[f64], end: f64) -> bool {
    let inside = sorted.iter().copied().filter(|value| *value != end);
    let step = inside.map(|value| (value - end).abs()).fold(f64::INFINITY, f64::min);
    let arrivals: Vec<(f64, f64)> = known
        .windows(3)
        .filter(|rows| values[rows[1]] != end && values[rows[2]] == end)
        .filter_map(|rows| {
            let [first, before, there] = [0, 1, 2].map(|at| values[rows[at]]);
            // The one under which it came: where a command changes in the row of a reading, that one answers to the last.
            let under = command.get(..rows[2])?.iter().rev().find(|command| command.is_finite())?;
            Some(((there - before).abs().max((before - first).abs()), *under))
        })
        .collect();
    let Some(usual) = median(arrivals.iter().map(|(_, command)| *command)) else { return false };
    let same =
        arrivals.iter().filter(|(_, command)| (command - usual).abs() <= THRESHOLDS.level_command).count()
            as f64;
    let comes = median(arrivals.iter().map(|(comes, _)| *comes));
    same >= THRESHOLDS.level_share * arrivals.len() as f64
        && comes.is_some_and(|comes| comes <= THRESHOLDS.level_steps * step)
}

/// Share of neighbours that are equal.
fn stay(pairs: &[[f64; 2]]) -> f64 {
    pairs.iter().filter(|[it, next]| it == next).count() as f64 / pairs.len().max(1) as f64
}
