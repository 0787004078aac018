//! What a log looks like before anybody fits anything to it: rate, jitter, holes, channels that are frozen, clipped
//! or drop out, starts from standstill.

use std::ops::Range;

use serde::Serialize;

use super::frozen_gyro::{frozen, smallest_step};
use super::readings::Unmeasured;
use super::saturation::Clip;
use super::saturation::{self, piles};
use crate::estimation::quantile::{median, quantile};
use crate::log::dataset::{Dataset, LOG_SIGNALS};
use crate::screening::Finding;
use crate::unit::short;

#[cfg(test)]
mod tests;

/// A stretch without a value is a dropout when longer than this many of the channel's own median intervals.
const DROPOUT_FACTOR: f64 = 2.5;
/// A rotor slower than this share of its fastest stands still.
const STANDSTILL_SHARE: f64 = 0.05;
/// A channel that moves slowly beside the steps of its reading, and those that it takes at once, at most.
const BATTERY: &str = "battery_voltage_v";
const A_STEP: f64 = 2.5;
/// [s] a change of command this long before a hole, or inside it, is named with it.
const BEFORE_HOLE_S: f64 = 0.1;

/// Which way the commands went around a hole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Step {
    /// A command rose.
    Up,
    /// A command fell.
    Down,
}

/// A gap in time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HoleFinding {
    /// [s] when it begins.
    pub start_s: f64,
    /// [s] how long it is.
    pub length_s: f64,
    /// Which way a command stepped just before or inside it.
    pub at_step: Option<Step>,
}

/// A stretch of time in one channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Stretch {
    /// [s] when it begins.
    pub start_s: f64,
    /// [s] how long it is.
    pub length_s: f64,
    /// The value held; for a dropout the last one before it.
    pub value: f64,
}

/// What one channel looks like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelFindings {
    /// Name in the log.
    pub name: String,
    /// Cells with a value.
    pub samples: usize,
    /// Cells without.
    pub missing: usize,
    /// [s] median time between values.
    pub median_interval_s: f64,
    /// Least and greatest value.
    pub range: [f64; 2],
    /// It never changes.
    pub constant: bool,
    /// Stretches in which it repeats a value longer than its own liveliness explains.
    pub frozen: Vec<Stretch>,
    /// Ends at which it piles up.
    pub clipped: Vec<Clip>,
    /// Stretches without a value, holes in time apart.
    pub dropouts: Vec<Stretch>,
    /// Cells that are no measurements.
    #[serde(flatten)]
    pub unmeasured: Unmeasured,
}

/// What a log looks like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// Rows.
    pub samples: usize,
    /// [s] first and last time.
    pub time_s: [f64; 2],
    /// [s] median time between rows.
    pub median_interval_s: f64,
    /// [s] 5th and 95th percentile and greatest time between rows, holes apart.
    pub interval_s: [f64; 3],
    /// Gaps in time.
    pub holes: Vec<HoleFinding>,
    /// [s] when a rotor began to turn from standstill.
    pub standstill_starts_s: Vec<f64>,
    /// Channel by channel.
    pub channels: Vec<ChannelFindings>,
    /// The same in sentences: what somebody who fits a model to this log must know.
    pub findings: Vec<Finding>,
}

impl Findings {
    /// Looks through a log.
    #[must_use]
    pub fn of(log: &Dataset) -> Self {
        let time = log.time();
        let median = log.median_interval();
        let limit = 2.5 * median;
        let intervals =
            || time.windows(2).map(|pair| pair[1] - pair[0]).filter(|interval| *interval <= limit);
        let channels = log.names().filter_map(|name| Some(channel(log, name, log.column(name)?))).collect();
        let mut findings = Self {
            samples: log.len(),
            time_s: [time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0)],
            median_interval_s: median,
            interval_s: [0.05, 0.95, 1.0].map(|share| quantile(intervals(), share).unwrap_or(0.0)),
            holes: holes(log),
            standstill_starts_s: standstill_starts(log),
            channels,
            findings: Vec::new(),
        };
        findings.findings = findings.sentences();
        findings
    }

    fn sentences(&self) -> Vec<Finding> {
        let mut said: Vec<Finding> = Vec::new();
        if let Some(longest) = self.holes.iter().map(|hole| hole.length_s).max_by(f64::total_cmp) {
            let count = |step| self.holes.iter().filter(|hole| hole.at_step == Some(step)).count();
            let typical = 1e3 * self.median_interval_s;
            said.push(format!(
                "{} in time (rows are {typical:.1} ms apart, the longest hole is {:.0} ms): {} at up-steps of a \
                 command, {} at down-steps",
                counted(self.holes.len(), "hole"),
                1e3 * longest,
                count(Step::Up),
                count(Step::Down)
            ).into());
        }
        if !self.standstill_starts_s.is_empty() {
            let first = self.standstill_starts_s[0];
            said.push(format!(
                "{} from standstill, the first at {first:.3} s: what happens there is not in the model's range",
                counted(self.standstill_starts_s.len(), "start")
            ).into());
        }
        for channel in &self.channels {
            channel.sentences(self.median_interval_s, &mut said);
        }
        said
    }
}

impl ChannelFindings {
    fn sentences(&self, interval: f64, said: &mut Vec<Finding>) {
        let name = &self.name;
        // That the guard was armed throughout is how it should be.
        if self.constant && !name.starts_with("guard_") {
            said.push(format!("`{name}` is {} throughout", short(self.range[0])).into());
        }
        if let Some(longest) = longest(&self.frozen).filter(|_| self.unmeasured.stuck.is_none()) {
            let (length, start, value) = (longest.length_s, longest.start_s, short(longest.value));
            let count = counted(self.frozen.len(), "time");
            said.push(
                format!("`{name}` is frozen {count}, longest for {length:.3} s from {start:.3} s at {value}")
                    .into(),
            );
        }
        // Where it is sure that they are no measurements it is told with what follows of it.
        for clip in self.clipped.iter().filter(|_| self.unmeasured.clipped.is_none()) {
            said.push(
                format!("`{name}` is clipped at {}: {} samples stand there", short(clip.at), clip.samples)
                    .into(),
            );
        }
        if let Some(longest) = longest(&self.dropouts) {
            let (length, start) = (longest.length_s, longest.start_s);
            let count = counted(self.dropouts.len(), "time");
            said.push(
                format!("`{name}` drops out {count}, longest for {length:.3} s from {start:.3} s").into(),
            );
        }
        said.extend(self.unmeasured.sentences(name, interval).into_iter().map(Finding::from));
    }
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn longest(stretches: &[Stretch]) -> Option<&Stretch> {
    stretches.iter().max_by(|a, b| a.length_s.total_cmp(&b.length_s))
}

/// Commands hold by nature: they neither freeze nor clip.
fn is_command(name: &str) -> bool {
    name.contains("command") || !LOG_SIGNALS.iter().any(|known| known.name == name)
}

fn channel(log: &Dataset, name: &str, values: &[f64]) -> ChannelFindings {
    // Time, value and place of each cell that holds one.
    let present: Vec<(f64, f64, usize)> = log
        .time()
        .iter()
        .zip(values)
        .enumerate()
        .filter(|(_, (_, value))| value.is_finite())
        .map(|(row, (time, value))| (*time, *value, row))
        .collect();
    let median = median(present.windows(2).map(|pair| pair[1].0 - pair[0].0)).unwrap_or(0.0);
    let mut sorted: Vec<f64> = present.iter().map(|(_, value, _)| *value).collect();
    sorted.sort_by(f64::total_cmp);
    let range = [sorted.first(), sorted.last()].map(|end| end.copied().unwrap_or(0.0));
    let constant = present.len() > 2 && range[0] == range[1];
    let measured = !is_command(name) && !constant;
    ChannelFindings {
        name: name.to_owned(),
        samples: present.len(),
        missing: values.len() - present.len(),
        median_interval_s: median,
        range,
        constant,
        frozen: if measured { stretches(name, &present) } else { Vec::new() },
        clipped: if measured { clips(log, name, values, &sorted) } else { Vec::new() },
        dropouts: dropouts(log, &present, median),
        unmeasured: Unmeasured::of(log, name),
    }
}

/// Ends of its range at which a channel piles up. A battery settles at levels, too, which is asked of its reading.
fn clips(log: &Dataset, name: &str, values: &[f64], sorted: &[f64]) -> Vec<Clip> {
    let mut clips = piles(sorted);
    if name == BATTERY && !clips.is_empty() {
        let found = saturation::find(values, log.column("command_1").or(log.column("command_2")));
        clips.retain(|clip| found.as_ref().is_some_and(|found| found.at.contains(&clip.at)));
    }
    clips
}

/// The runs of equal values that a reading did not just go on from: a battery that is read in steps stands on each. At the
/// end of the log one that is no longer than others were will have gone on, too.
fn without_treads(values: &[f64], runs: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let step = smallest_step(values);
    let goes_on = |run: &Range<usize>| {
        values.get(run.end).is_some_and(|next| (next - values[run.start]).abs() <= A_STEP * step)
    };
    let longest = runs.iter().filter(|run| goes_on(run)).map(Range::len).max().unwrap_or(0);
    let is_tread = |run: &Range<usize>| goes_on(run) || (run.end == values.len() && run.len() <= 2 * longest);
    runs.into_iter().filter(|run| !is_tread(run)).collect()
}

/// Runs of equal values that are too long for the channel. A rotor that stands still reads zero, rightly.
fn stretches(name: &str, present: &[(f64, f64, usize)]) -> Vec<Stretch> {
    let values: Vec<f64> = present.iter().map(|(_, value, _)| *value).collect();
    let stands = |value: f64| name.starts_with("propeller_rate") && value == 0.0;
    let found = frozen(&values);
    let found = if name == BATTERY { without_treads(&values, found) } else { found };
    let runs = found.into_iter().filter(|run| !stands(values[run.start]));
    runs.map(|run| Stretch {
        start_s: present[run.start].0,
        length_s: present[run.end - 1].0 - present[run.start].0,
        value: values[run.start],
    })
    .collect()
}

/// Stretches between two values of a channel that are too long for it, where the log itself has rows.
fn dropouts(log: &Dataset, present: &[(f64, f64, usize)], median: f64) -> Vec<Stretch> {
    let hole_after: std::collections::BTreeSet<usize> = log.holes().iter().map(|hole| hole.after).collect();
    let holds_hole = |from: usize, to: usize| hole_after.range(from..to).next().is_some();
    present
        .windows(2)
        .filter(|pair| pair[1].0 - pair[0].0 > DROPOUT_FACTOR * median && pair[1].2 > pair[0].2 + 1)
        .filter(|pair| !holds_hole(pair[0].2, pair[1].2))
        .map(|pair| Stretch { start_s: pair[0].0, length_s: pair[1].0 - pair[0].0, value: pair[0].1 })
        .collect()
}

fn holes(log: &Dataset) -> Vec<HoleFinding> {
    let commands: Vec<&[f64]> =
        ["command_1", "command_2", "torque_command_nm"].iter().filter_map(|name| log.column(name)).collect();
    let step_around = |after: usize, start: f64| {
        let first = log.time().partition_point(|time| *time < start - BEFORE_HOLE_S);
        commands.iter().find_map(|command| {
            let before = command.get(first.saturating_sub(1))?;
            let behind = command.get(after + 1)?;
            (behind != before).then_some(if behind > before { Step::Up } else { Step::Down })
        })
    };
    log.holes()
        .iter()
        .map(|hole| HoleFinding {
            start_s: hole.start,
            length_s: hole.length,
            at_step: step_around(hole.after, hole.start),
        })
        .collect()
}

fn standstill_starts(log: &Dataset) -> Vec<f64> {
    let mut starts = Vec::new();
    let columns = ["propeller_rate_1_rad_s", "propeller_rate_2_rad_s"].map(|name| log.column(name));
    // Of both: the greatest rate of a rotor that rests all the time is its sensor's noise.
    let all = columns.into_iter().flatten().flatten().copied();
    let limit = STANDSTILL_SHARE * all.filter(|rate| rate.is_finite()).fold(0.0, f64::max);
    for rates in columns.into_iter().flatten() {
        let known: Vec<(f64, bool)> = log
            .time()
            .iter()
            .zip(rates)
            .filter(|(_, rate)| rate.is_finite())
            .map(|(time, rate)| (*time, *rate < limit))
            .collect();
        // Three samples at rest before it starts: one slow reading is noise.
        starts.extend(
            known.windows(4).filter(|it| it[0].1 && it[1].1 && it[2].1 && !it[3].1).map(|it| it[3].0),
        );
    }
    starts.sort_by(f64::total_cmp);
    starts
}
