//! What a log looks like before anybody fits anything to it: rate, jitter, holes, channels that are frozen, saturated
//! or drop out, starts from standstill.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Serialize, Serializer};

use super::channel::BATTERY;
use super::checks::frozen_gyro::{GYRO_FROZEN, frozen, smallest_step};
use super::checks::rate_dropout::RATE_FROZEN;
use super::checks::saturation::{self, SATURATED, Saturation, piles};
use super::screened_body::ScreenedBody;
use super::screened_log::{ScreenedChannel, ScreenedLog};
use super::screened_rotor::ScreenedRotor;
use super::thresholds::THRESHOLDS;
use super::{Evidence, Finding};
use crate::estimation::quantile::{median, quantile, sorted};
use crate::log;
use crate::log::dataset::{Dataset, LOG_SIGNALS};

mod rows;
#[cfg(test)]
mod tests;

pub use rows::{BodySummary, RotorSummary};

/// Which way the commands went around a hole.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Step {
    /// A command rose.
    Up,
    /// A command fell.
    Down,
}

/// A gap in time.
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelSummary {
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
    /// Stretches in which it repeats a value longer than its own motion explains.
    pub frozen: Vec<Stretch>,
    /// Ends at which it piles up.
    pub perhaps_saturated: Vec<Saturation>,
    /// Stretches without a value, holes in time apart.
    pub dropouts: Vec<Stretch>,
    /// Cells that are no measurements.
    #[serde(flatten)]
    #[cfg_attr(test, schemars(with = "BTreeMap<String, serde_json::Value>"))]
    pub not_measured: NotMeasured,
}

/// What a log looks like.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LogSummary {
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
    /// [s] when a rotor that stood was commanded to turn.
    pub standstill_starts_s: Vec<f64>,
    /// Channel by channel.
    pub channels: Vec<ChannelSummary>,
    /// Rotor by rotor, of those whose commands and rates the log holds.
    pub rotors: Vec<RotorSummary>,
    /// The same of their thrusts, where the log holds thrusts and rates.
    pub thrusts: Vec<RotorSummary>,
    /// The same of the body.
    pub body: Option<BodySummary>,
    /// What somebody who fits a model to this log must know.
    pub findings: Vec<Finding>,
}

impl LogSummary {
    /// Looks through a log.
    #[must_use]
    pub fn of(screened: &ScreenedLog) -> Self {
        let log = screened.raw();
        let time = log.time();
        let median = log.median_interval();
        let limit = log::thresholds::THRESHOLDS.hole * median;
        let intervals =
            || time.windows(2).map(|pair| pair[1] - pair[0]).filter(|interval| *interval <= limit);
        let named = log.names().filter_map(|name| Some((name, log.column(name)?)));
        let channels = named.map(|(name, values)| channel(screened, log, name, values)).collect();
        let mut summary = Self {
            samples: log.len(),
            time_s: [time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0)],
            median_interval_s: median,
            interval_s: THRESHOLDS.shown_intervals.map(|share| quantile(intervals(), share).unwrap_or(0.0)),
            holes: holes(log),
            standstill_starts_s: sorted(screened.rotors().flat_map(ScreenedRotor::starts)),
            channels,
            rotors: screened.rotors().map(|rotor| RotorSummary::of(rotor, log.len())).collect(),
            thrusts: RotorSummary::of_thrusts(screened),
            body: BodySummary::of(screened),
            findings: Vec::new(),
        };
        summary.findings = summary.found(screened);
        summary
    }

    fn found(&self, log: &ScreenedLog) -> Vec<Finding> {
        let of = |code, channel: &str| Finding::new(code, channel).of(log.source_name());
        let mut found: Vec<Finding> = log.column_findings().to_vec();
        if let Some(longest) = self.holes.iter().map(|hole| hole.length_s).max_by(f64::total_cmp) {
            let count = |step| self.holes.iter().filter(|hole| hole.at_step == Some(step)).count();
            let finding = of("holes", "time_s").with("count", self.holes.len()).with("longest_s", longest);
            let finding = finding.with("interval_s", self.median_interval_s);
            found.push(finding.with("at_up_steps", count(Step::Up)).with("at_down_steps", count(Step::Down)));
        }
        if let Some(first) = self.standstill_starts_s.first() {
            let finding = of("starts_from_standstill", "").with("count", self.standstill_starts_s.len());
            found.push(finding.with("first_s", *first));
        }
        for channel in &self.channels {
            found.extend(channel.found(&of));
            found.extend(channel.not_measured.0.iter().cloned());
        }
        found.extend(log.rotor_findings().cloned());
        found.extend(log.body().and_then(ScreenedBody::finding).cloned());
        found
    }
}

impl ChannelSummary {
    /// What may be wrong with it; where it is sure that cells are no measurements that is a finding of its own.
    fn found(&self, of: &impl Fn(&'static str, &str) -> Finding) -> Vec<Finding> {
        let mut found = Vec::new();
        let of = |code| of(code, &self.name);
        let with_longest = |finding: Finding, stretches: &[Stretch], longest: &Stretch| {
            let finding = finding.with("count", stretches.len()).with("longest_s", longest.length_s);
            finding.with("from_s", longest.start_s).with("value", longest.value)
        };
        // That the guard was armed throughout is how it should be.
        if self.constant && !self.name.starts_with("guard_") {
            found.push(of("constant").with("value", self.range[0]));
        }
        let is_sure = |codes: &[&str]| self.not_measured.0.iter().any(|it| codes.contains(&it.code));
        if let Some(longest) = longest(&self.frozen).filter(|_| !is_sure(&[GYRO_FROZEN, RATE_FROZEN])) {
            found.push(with_longest(of("perhaps_frozen"), &self.frozen, longest));
        }
        for clip in self.perhaps_saturated.iter().filter(|_| !is_sure(&[SATURATED])) {
            found.push(of("perhaps_saturated").with("at", clip.at).with("samples", clip.samples));
        }
        if let Some(longest) = longest(&self.dropouts) {
            found.push(with_longest(of("dropouts"), &self.dropouts, longest));
        }
        found
    }
}

/// What checks found in a channel, each under its code.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NotMeasured(pub Vec<Finding>);

impl Serialize for NotMeasured {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Cells<'a> {
            cells: usize,
            #[serde(flatten)]
            evidence: BTreeMap<&'a str, &'a Evidence>,
        }
        serializer.collect_map(self.0.iter().map(|finding| {
            let evidence = finding.evidence.iter().map(|(name, value)| (*name, value)).collect();
            (finding.code, Cells { cells: finding.rows, evidence })
        }))
    }
}

fn longest(stretches: &[Stretch]) -> Option<&Stretch> {
    stretches.iter().max_by(|a, b| a.length_s.total_cmp(&b.length_s))
}

/// Commands hold by nature: they neither freeze nor saturate.
fn is_command(name: &str) -> bool {
    name.contains("command") || !LOG_SIGNALS.iter().any(|known| known.name == name)
}

fn channel(screened: &ScreenedLog, log: &Dataset, name: &str, values: &[f64]) -> ChannelSummary {
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
    let sorted = sorted(present.iter().map(|(_, value, _)| *value));
    let range = [sorted.first(), sorted.last()].map(|end| end.copied().unwrap_or(0.0));
    let constant = present.len() > 2 && range[0] == range[1];
    let measured = !is_command(name) && !constant;
    ChannelSummary {
        name: name.to_owned(),
        samples: present.len(),
        missing: values.len() - present.len(),
        median_interval_s: median,
        range,
        constant,
        frozen: if measured { stretches(name, &present) } else { Vec::new() },
        perhaps_saturated: if measured { saturations(log, name, values, &sorted) } else { Vec::new() },
        dropouts: dropouts(log, &present, median),
        not_measured: NotMeasured(screened.channel(name).map(ScreenedChannel::findings).unwrap_or_default()),
    }
}

/// Ends of its range at which a channel piles up. A battery settles at levels, too, which is asked of its reading.
fn saturations(log: &Dataset, name: &str, values: &[f64], sorted: &[f64]) -> Vec<Saturation> {
    let mut saturations = piles(sorted);
    if name == BATTERY && !saturations.is_empty() {
        let found = saturation::find(values, log.column("command_1").or(log.column("command_2")));
        saturations.retain(|clip| found.as_ref().is_some_and(|found| found.at.contains(&clip.at)));
    }
    saturations
}

/// The runs of equal values that a reading did not just go on from: a battery that is read in steps stands on each. At the
/// end of the log one that is no longer than others were will have gone on, too.
fn without_treads(values: &[f64], runs: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let step = smallest_step(values);
    let goes_on = |run: &Range<usize>| {
        values
            .get(run.end)
            .is_some_and(|next| (next - values[run.start]).abs() <= THRESHOLDS.battery_step * step)
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
        .filter(|pair| pair[1].0 - pair[0].0 > THRESHOLDS.gap_factor * median && pair[1].2 > pair[0].2 + 1)
        .filter(|pair| !holds_hole(pair[0].2, pair[1].2))
        .map(|pair| Stretch { start_s: pair[0].0, length_s: pair[1].0 - pair[0].0, value: pair[0].1 })
        .collect()
}

fn holes(log: &Dataset) -> Vec<HoleFinding> {
    let commands: Vec<&[f64]> =
        ["command_1", "command_2", "torque_command_nm"].iter().filter_map(|name| log.column(name)).collect();
    let step_around = |after: usize, start: f64| {
        let first = log.time().partition_point(|time| *time < start - THRESHOLDS.before_hole);
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
