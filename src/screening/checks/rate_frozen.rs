//! A rate that stands still to the last digit while the command moves the rotor.

use std::ops::Range;

use super::sample_and_hold::SAMPLE_AND_HOLD;
use crate::estimation::moments::mean_of;
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
        let commands = bounds(&command[first..=last]);
        if unanswered && !is_within_steps(command, rate, value, commands, scale) {
            found.push(Frozen { rows: rows.to_vec(), value, from, to, commands });
        }
    }
    found
}

/// Whether commands that move this little leave a reading on its value by what they do elsewhere in the log: near its limit a rotor hardly
/// answers, and its rate stays within a step of the reading. Rows with the same reading say nothing: they may have stood still, too.
fn is_within_steps(
    command: &[f64],
    rate: &[f64],
    value: f64,
    (low, high): (f64, f64),
    scale: &Scale,
) -> bool {
    let near = (2.0 * low - high)..=(2.0 * high - low);
    let counts = |row: &usize| near.contains(&command[*row]) && rate[*row].is_finite() && rate[*row] != value;
    let rows: Vec<usize> = (0..rate.len()).filter(counts).collect();
    let [u, w] = [command, rate].map(|of| mean_of(rows.iter().map(|row| of[*row])));
    let (mut products, mut squares) = (0.0, 0.0);
    for row in &rows {
        products += (command[*row] - u) * (rate[*row] - w);
        squares += (command[*row] - u).powi(2);
    }
    let moved = (products / squares).abs() * (high - low);
    let step = scale.step(value).unwrap_or(0.0);
    rows.len() >= THRESHOLDS.rate_frozen_fewest && moved <= THRESHOLDS.rate_frozen_steps * step
}

#[cfg(test)]
mod tests {
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// A rotor near its limit, whose rate rises by a part of a step of its reading from row to row, and falls as slowly; where it is
    /// `frozen` it reads one value for 30 rows.
    fn log(frozen: bool) -> ScreenedLog {
        let at = |row: usize| row as f64 / 400.0;
        let command = |row: usize| if row < 400 { 0.3 + 0.7 * at(row) } else { 1.0 - 0.7 * (at(row) - 1.0) };
        let rate = |row: usize| {
            let turns = 500.0 * (1.0 - (-6.0 * command(row)).exp());
            if frozen && (100..130).contains(&row) { 276.0 * 1.7 } else { (turns / 1.7).round() * 1.7 }
        };
        let of = |value: &dyn Fn(usize) -> f64| (0..800).map(value).collect::<Vec<f64>>();
        let columns = [("command_1", of(&command)), ("propeller_rate_1_rad_s", of(&rate))];
        Dataset::made(of(&|row| 0.3 * row as f64), columns).into()
    }

    #[test]
    fn a_reading_that_stays_on_its_step_near_the_limit_is_not_frozen() {
        let found = |frozen: bool| {
            let log = log(frozen);
            let found = log.channel_findings().find(|it| it.code == super::RATE_FROZEN).cloned();
            found.map(|it| it.rows)
        };
        assert_eq!(found(false), None);
        assert_eq!(found(true), Some(30));
    }
}
