//! Readings of a rate that are no measurement: zeros of a telemetry that dropped out, and a reading that stands still
//! to the last digit while the command moves the rotor.

use std::ops::Range;

use super::sample_and_hold::SAMPLE_AND_HOLD;
use crate::estimation::quantile::{distinct, median, quantile};
use crate::screening::channel::{Channel, Judgement};
use crate::screening::rotor_data::{LEAST_COMMAND, bounds, held};
use crate::screening::thresholds::THRESHOLDS;

/// The code: a rate of exactly zero although the rotor was commanded to turn.
pub const RATE_DROPOUT: &str = "rate_dropout";
/// The code: a rate that stood still to the last digit while the command moved.
pub const RATE_FROZEN: &str = "rate_frozen";

/// Zeros of a rotor's rate that are no measurement.
pub(crate) fn zeros(channel: &Channel) -> Option<Judgement> {
    let command = channel.command.filter(|_| channel.is_rotor_rate())?;
    let (time, segments) = (channel.log.time(), channel.log.segments());
    let (command, rate) = (held(command, &segments), channel.left());
    let rows: Vec<usize> =
        segments.iter().flat_map(|segment| zeros_of(time, &command, &rate, segment)).collect();
    let finding = channel.finding(RATE_DROPOUT).with("first_s", time[*rows.first()?]);
    Some(Judgement::new(finding, rows))
}

/// Readings of a rotor's rate that did not answer to the command.
pub(crate) fn frozen(channel: &Channel) -> Option<Judgement> {
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

/// Rows of a segment that read zero although the rotor turned, or should have.
fn zeros_of(time: &[f64], command: &[f64], rate: &[f64], segment: &Range<usize>) -> Vec<usize> {
    let middle = middle(rate);
    let is_started = started(time, command, segment);
    let known: Vec<usize> = segment.clone().filter(|row| rate[*row].is_finite()).collect();
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
        if is_short || is_missed || rows.iter().any(|row| is_started[*row - segment.start]) {
            zeros.extend(rows.iter().filter(is_commanded));
        }
        at += count.max(1);
    }
    zeros
}

/// Whether the first of these rows reads what a rotor reads that turned before: one that starts climbs from near zero, and
/// has got far when as little time is over as this looks away from.
fn is_up(time: &[f64], rate: &[f64], rows: &[usize]) -> bool {
    let Some(first) = rows.first() else { return false };
    let behind = rows.iter().filter(|row| {
        (THRESHOLDS.dropout_got_far..THRESHOLDS.dropout_started).contains(&(time[**row] - time[*first]))
    });
    let sizes = behind.map(|row| rate[*row].abs()).filter(|size| *size > 0.0);
    quantile(sizes, THRESHOLDS.dropout_low)
        .is_some_and(|low| rate[*first].abs() >= THRESHOLDS.dropout_at_once * low)
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
/// judged by [`zeros_of`].
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::Finding;

    const ROWS: usize = 6000;
    const RATE: &str = "propeller_rate_1_rad_s";

    fn hash(row: usize) -> usize {
        row.wrapping_mul(2_654_435_761) >> 7
    }

    /// Two levels, each for a tenth of a second at least, or what `command` says; a rotor of 16 rad/s, its rate read with 2
    /// rad/s of noise in steps of `step` [rad/s].
    fn log(command: impl Fn(f64) -> f64, noise: f64, step: f64) -> Dataset {
        let time: Vec<f64> = (0..ROWS).map(|row| row as f64 * 0.02).collect();
        let commands: Vec<f64> = time.iter().map(|t| command(*t)).collect();
        let mut rate = 1400.0 * commands[0];
        let mut rates = Vec::new();
        for (row, command) in commands.iter().enumerate() {
            let scatter = noise * ((hash(row) >> 9 & 255) as f64 / 128.0 - 1.0);
            rates.push(((rate + scatter) / step).round() * step);
            rate += 0.27 * (1400.0 * command - rate);
        }
        let mut log = Dataset::new("log.csv", "", time).unwrap();
        log.insert("command_1", commands).unwrap();
        log.insert("propeller_rate_1_rad_s", rates).unwrap();
        log
    }

    fn binary(t: f64) -> f64 {
        if hash((t / 0.1 + 0.5) as usize) & 1 == 1 { 0.5 } else { 0.4 }
    }

    /// Rows of rotor 1 that were taken away, and what was found.
    fn taken(log: &Dataset) -> (Vec<usize>, Vec<Finding>) {
        let mut channel = Channel::of(log, RATE).unwrap();
        for check in [zeros, frozen] {
            let found = check(&channel);
            channel.found.extend(found);
        }
        let mut rows: Vec<usize> = channel.found.iter().flat_map(|judged| judged.rows.clone()).collect();
        rows.sort_unstable();
        (rows, channel.found.into_iter().map(|judged| judged.finding).collect())
    }

    fn changed(log: &Dataset, change: impl Fn(usize, f64) -> f64) -> Dataset {
        let name = RATE;
        let rates = log.column(name).unwrap().iter().enumerate();
        let mut log = log.clone();
        log.replace(name, rates.map(|(row, rate)| change(row, *rate)).collect()).unwrap();
        log
    }

    #[test]
    fn a_rate_that_freezes_is_left_out_and_found() {
        let excited = log(binary, 2.0, 1e-3);
        let (rows, findings) = taken(&changed(&excited, |_, _| 612.5));
        assert_eq!(rows.len(), ROWS, "never moved: {findings:?}");
        assert_eq!((findings.len(), findings[0].code, findings[0].rows), (1, RATE_FROZEN, ROWS));
        let value = |name: &str| findings[0].number(name);
        assert_eq!([value("value"), value("least_command"), value("greatest_command")], [612.5, 0.4, 0.5]);
        assert!(value("from_s") == 0.0 && (value("to_s") - 120.0).abs() < 0.03, "{findings:?}");
        let last = excited.column("propeller_rate_1_rad_s").unwrap()[3000];
        let half = changed(&excited, |row, rate| if (3000..4000).contains(&row) { last } else { rate });
        let (rows, findings) = taken(&half);
        assert_eq!((rows.first(), rows.last(), rows.len()), (Some(&3000), Some(&3999), 1000), "{findings:?}");
        assert!((findings[0].number("from_s") - 60.0).abs() < 0.03, "{findings:?}");
        assert!((findings[0].number("to_s") - 80.0).abs() < 0.03 && findings[0].rows == 1000, "{findings:?}");
    }

    #[test]
    fn what_a_good_reading_does_is_no_freezing() {
        // A coarse reading under one level, under levels that change once, on a slow ramp and on its way back, and beside a
        // command that moves by less than the reading resolves.
        let ramp = |t: f64| 0.3 + 0.002 * (60.0 - (t - 60.0).abs());
        for (name, log) in [
            ("one level", log(|_| 0.45, 0.0, 10.0)),
            ("levels", log(|t| 0.3 + 0.1 * (t / 20.0).floor() / 5.0, 0.0, 10.0)),
            ("ramp", log(ramp, 0.0, 10.0)),
            ("coarse", log(|t| 0.46 + 0.002 * (2.0 * t).sin().signum(), 0.0, 20.0)),
            ("excited", log(binary, 0.0, 10.0)),
            ("at rest", log(|t| if t < 60.0 { 0.03 * (t / 30.0).floor() } else { 0.45 }, 0.0, 10.0)),
        ] {
            assert_eq!(taken(&log), (vec![], vec![]), "{name}");
        }
        let dead_zone = log(|t| 0.06 + 0.04 * (t / 10.0).floor() / 12.0, 0.0, 10.0);
        assert_eq!(taken(&changed(&dead_zone, |_, _| 0.0)), (vec![], vec![]), "a rotor below its dead zone");
    }

    #[test]
    fn single_zeros_are_missing_and_counted() {
        let excited = log(binary, 2.0, 1e-3);
        let lost = |row: usize| row > 0 && (hash(row).is_multiple_of(40) || (3000..3003).contains(&row));
        let (rows, findings) = taken(&changed(&excited, |row, rate| if lost(row) { 0.0 } else { rate }));
        let expected: Vec<usize> = (0..ROWS).filter(|row| lost(*row)).collect();
        assert!(expected.len() > 100 && rows == expected, "{findings:?}");
        assert_eq!((findings[0].code, findings[0].rows), (RATE_DROPOUT, expected.len()));
        // Long ones are no better, once the rotor must have started; a rotor that starts is none.
        let (rows, findings) = taken(&changed(&excited, |row, rate| if row >= 4000 { 0.0 } else { rate }));
        assert_eq!((rows.first(), rows.len()), (Some(&4000), 2000), "{findings:?}");
        // Nor are those before the first frame; a rotor that starts, and one in its dead zone, are none of these.
        for count in [1, 3, 25] {
            let (rows, findings) =
                taken(&changed(&excited, |row, rate| if row < count { 0.0 } else { rate }));
            assert_eq!(rows, (0..count).collect::<Vec<usize>>(), "{findings:?}");
        }
        let from_rest =
            changed(&log(|_| 0.45, 0.0, 1e-3), |row, rate| rate * (1.0 - 0.73f64.powi(row as i32)));
        assert_eq!(taken(&from_rest), (vec![], vec![]), "it starts with the log");
        let dead_zone = log(|t| 0.06 + 0.02 * t, 2.0, 1e-3);
        let dead_zone = changed(&dead_zone, |row, rate| if row < 150 { 0.0 } else { rate });
        assert_eq!(taken(&dead_zone), (vec![], vec![]), "up to 0.12 it stands");
        let starts = log(|t| if t < 1.0 { 0.0 } else { 0.45 }, 2.0, 1e-3);
        let starts = changed(&starts, |row, rate| if row < 100 { 0.0 } else { rate });
        assert_eq!(taken(&starts), (vec![], vec![]), "it took a second to start");
    }
}
