//! A rate that stands still to the last digit while the command moves the rotor.

use std::ops::Range;

use super::sample_and_hold::SAMPLE_AND_HOLD;
use crate::estimation::quantile::distinct;
use crate::screening::channel::{CheckedChannel, Judgement};
use crate::screening::rotor_data::{LEAST_COMMAND, bounds, held};
use crate::screening::thresholds::THRESHOLDS;

/// The code: a rate that stood still to the last digit while the command moved.
pub const RATE_FROZEN: &str = "rate_frozen";

/// Readings of a rotor's rate that did not answer to the command.
pub(crate) fn check(channel: &CheckedChannel) -> Option<Judgement> {
    let command = channel.command.filter(|_| channel.is_rotor_rate())?;
    let (time, segments) = (channel.log.time(), channel.log.segments());
    // What a logger held may be frozen as well.
    let rate = channel.without(|code| code != SAMPLE_AND_HOLD);
    let command = held(command, &segments);
    let scale = Scale::of(&rate);
    let runs: Vec<Frozen> =
        segments.iter().flat_map(|segment| frozen_of(time, &command, &rate, segment, &scale)).collect();
    let longest = runs.iter().max_by(|a, b| a.span().total_cmp(&b.span()))?;
    let finding = channel
        .finding(RATE_FROZEN)
        .with("places", runs.len())
        .with("from_s", longest.from)
        .with("to_s", longest.to)
        .with("value", longest.value)
        .with("least_command", longest.commands.0)
        .with("greatest_command", longest.commands.1);
    Some(Judgement::new(finding, runs.into_iter().flat_map(|run| run.rows).collect()))
}

/// The values that a reading takes, ascending: how fine it is.
struct Scale(Vec<f64>);

impl Scale {
    fn of(rate: &[f64]) -> Self {
        Self(distinct(rate))
    }

    /// [rad/s] from one of the values to its nearest neighbour; `None` where it is the only one.
    fn step(&self, value: f64) -> Option<f64> {
        let at = self.0.partition_point(|other| *other < value);
        let below = at.checked_sub(1).and_then(|below| self.0.get(below)).map(|below| value - below);
        let above = self.0.get(at + 1).map(|above| above - value);
        below.into_iter().chain(above).reduce(f64::min)
    }
}

/// A reading that stood still.
struct Frozen {
    /// Rows with the reading.
    rows: Vec<usize>,
    /// [rad/s] what it read.
    value: f64,
    /// [s]
    from: f64,
    /// [s]
    to: f64,
    /// [-] lowest and highest command meanwhile.
    commands: (f64, f64),
}

impl Frozen {
    fn span(&self) -> f64 {
        self.to - self.from
    }
}

/// Runs of equal readings of a segment that did not answer to the command. A rotor that stands is none of them; zeros are
/// another check's.
fn frozen_of(
    time: &[f64],
    command: &[f64],
    rate: &[f64],
    segment: &Range<usize>,
    scale: &Scale,
) -> Vec<Frozen> {
    let is_known = |row: &usize| rate[*row].is_finite() && command[*row].is_finite();
    let known: Vec<usize> = segment.clone().filter(is_known).collect();
    let mut found = Vec::new();
    for rows in known.chunk_by(|a, b| rate[*a] == rate[*b]) {
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        let (value, from, to) = (rate[first], time[first], time[last]);
        if value == 0.0
            || rows.len() < THRESHOLDS.rate_frozen_fewest
            || to - from < THRESHOLDS.rate_frozen_shortest
        {
            continue;
        }
        // What the command's change would have done, by the chord of the rotor's curve, which is less steep than the curve.
        let chord = value.abs() / command[first].max(LEAST_COMMAND);
        let shows = scale.step(value).map_or(THRESHOLDS.rate_frozen_jump, |step| {
            (THRESHOLDS.rate_frozen_steps * step / chord).max(THRESHOLDS.rate_frozen_same)
        });
        let is_asked = |row: &usize| (command[*row] - command[first]).abs() > shows;
        let unanswered = (first..last)
            .find(is_asked)
            .is_some_and(|row| to - time[row] >= THRESHOLDS.rate_frozen_unanswered);
        if unanswered {
            let commands = bounds(&command[first..=last]);
            found.push(Frozen { rows: rows.to_vec(), value, from, to, commands });
        }
    }
    found
}
