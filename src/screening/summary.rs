//! What a log looks like before anybody fits anything to it: rate, jitter, holes, starts from standstill, and channel by channel what
//! the screened log has found. Nothing is judged here.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use super::channel::Judgement;
use super::checks::battery_saturated::BATTERY_SATURATED;
use super::checks::dropouts::DROPOUTS;
use super::checks::gyro_frozen::GYRO_FROZEN;
use super::checks::perhaps_frozen::PERHAPS_FROZEN;
use super::checks::perhaps_saturated::PERHAPS_SATURATED;
use super::checks::rate_frozen::RATE_FROZEN;
use super::checks::saturated::{SATURATED, Saturation};
use super::column::{CheckedColumn, Remark, Stretch};
use super::screened_log::ScreenedLog;
use super::screened_rotor::ScreenedRotor;
use super::thresholds::THRESHOLDS;
use super::{Evidence, Finding};
use crate::estimation::quantile::{quantiles, sorted};
use crate::log::dataset::{Dataset, is_hole};
use crate::signal::columns;
use crate::threads::spread;

mod rows;
#[cfg(test)]
mod tests;

pub use rows::{BodySummary, RotorSummary};

/// Which way the commands went around a hole.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StepDirection {
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
    pub at_step: Option<StepDirection>,
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
    /// Stretches in which it repeats a value longer than its own motion explains, or what moves it.
    pub frozen: Vec<Stretch>,
    /// Ends at which it piles up; surely, where `saturated` is there, too.
    pub perhaps_saturated: Vec<Saturation>,
    /// Stretches without a value, holes in time apart.
    pub dropouts: Vec<Stretch>,
    /// Cells that are no measurements.
    #[serde(flatten)]
    #[cfg_attr(test, schemars(with = "BTreeMap<String, serde_json::Value>"))]
    pub not_measured: NotMeasured,
    /// What is remarked of it, of which nothing is left out.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    remarks: Vec<Finding>,
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
        let intervals =
            time.windows(2).map(|pair| pair[1] - pair[0]).filter(|interval| !is_hole(*interval, median));
        let names: Vec<&str> = log.names().collect();
        let channels = spread(&names, |name| {
            let (column, remarks) = screened.look_at(name)?;
            Some(ChannelSummary::of(&column, &remarks))
        });
        let mut summary = Self {
            samples: log.len(),
            time_s: [time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0)],
            median_interval_s: median,
            interval_s: quantiles(intervals, THRESHOLDS.shown_intervals).unwrap_or([0.0; 3]),
            holes: holes(log),
            standstill_starts_s: sorted(screened.rotors().flat_map(ScreenedRotor::starts)),
            channels: channels.into_iter().flatten().collect(),
            rotors: spread(&screened.rotors().collect::<Vec<_>>(), |rotor| {
                RotorSummary::of(rotor, log.len())
            }),
            thrusts: RotorSummary::of_thrusts(screened),
            body: BodySummary::of(screened),
            findings: Vec::new(),
        };
        summary.findings = summary.found(screened);
        summary
    }

    fn found(&self, log: &ScreenedLog) -> Vec<Finding> {
        let of = |code, channel: &str| Finding::new(code, channel).of(log.source_name());
        let mut found: Vec<Finding> = log.column_findings().cloned().collect();
        if let Some(longest) = self.holes.iter().map(|hole| hole.length_s).max_by(f64::total_cmp) {
            let count = |step| self.holes.iter().filter(|hole| hole.at_step == Some(step)).count();
            let finding =
                of("holes", columns::TIME).with("count", self.holes.len()).with("longest_s", longest);
            let finding = finding.with("interval_s", self.median_interval_s);
            found.push(
                finding
                    .with("at_up_steps", count(StepDirection::Up))
                    .with("at_down_steps", count(StepDirection::Down)),
            );
        }
        if let Some(first) = self.standstill_starts_s.first() {
            let finding = of("starts_from_standstill", "").with("count", self.standstill_starts_s.len());
            found.push(finding.with("first_s", *first));
        }
        for channel in &self.channels {
            found.extend(channel.remarks.iter().chain(&channel.not_measured.0).cloned());
        }
        found.extend(log.rotor_findings().cloned());
        found.extend(log.body_findings().cloned());
        found
    }
}

impl ChannelSummary {
    fn of(column: &CheckedColumn, remarks: &[Remark]) -> Self {
        let judged = column.judged.iter().map(|judged| judged.finding.clone());
        Self {
            name: column.name.to_owned(),
            samples: column.present.len(),
            missing: column.values.len() - column.present.len(),
            median_interval_s: column.interval,
            range: column.range(),
            constant: column.is_constant(),
            frozen: match column.judgement(&[GYRO_FROZEN, RATE_FROZEN]) {
                Some(judged) => frozen(column, judged),
                None => stretches(remarks, PERHAPS_FROZEN),
            },
            perhaps_saturated: match column.judgement(&[SATURATED, BATTERY_SATURATED]) {
                Some(judged) => ends(column, judged),
                None => perhaps_ends(remarks),
            },
            dropouts: stretches(remarks, DROPOUTS),
            not_measured: NotMeasured(judged.collect()),
            remarks: remarks.iter().map(|it| it.finding.clone()).collect(),
        }
    }
}

/// The stretches of a remark.
fn stretches(remarks: &[Remark], code: &str) -> Vec<Stretch> {
    remarks.iter().filter(|it| it.finding.code == code).flat_map(|it| it.stretches.clone()).collect()
}

/// The stretches in which a channel is frozen: the rows of what was found, and the reading before that they repeat.
fn frozen(column: &CheckedColumn, judged: &Judgement) -> Vec<Stretch> {
    let present = &column.present;
    let value = |at: usize| column.values[present[at]];
    let places: Vec<usize> = judged.rows.iter().filter_map(|row| present.binary_search(row).ok()).collect();
    let runs = places.chunk_by(|a, b| *b == a + 1 && value(*a) == value(*b));
    let stretch = |run: &[usize]| {
        let (first, last) = (run[0], run[run.len() - 1]);
        let before = first.checked_sub(1).filter(|before| value(*before) == value(first));
        column.stretch(present[before.unwrap_or(first)], present[last])
    };
    runs.map(stretch).collect()
}

/// The ends at which a channel is saturated, and how many of its readings stand there.
fn ends(column: &CheckedColumn, judged: &Judgement) -> Vec<Saturation> {
    let samples = |at: f64| judged.rows.iter().filter(|row| column.values[**row] == at).count();
    judged.finding.numbers("at").iter().map(|at| Saturation { at: *at, samples: samples(*at) }).collect()
}

/// The same of a channel of which it is not sure.
fn perhaps_ends(remarks: &[Remark]) -> Vec<Saturation> {
    let found = remarks.iter().map(|it| &it.finding).filter(|it| it.code == PERHAPS_SATURATED);
    found.map(|it| Saturation { at: it.number("at"), samples: it.count("samples") }).collect()
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

fn holes(log: &Dataset) -> Vec<HoleFinding> {
    let commands: Vec<&[f64]> = [columns::COMMANDS[0], columns::COMMANDS[1], columns::TORQUE_COMMAND]
        .iter()
        .filter_map(|name| log.column(name))
        .collect();
    let step_around = |after: usize, start: f64| {
        let first = log.time().partition_point(|time| *time < start - THRESHOLDS.before_hole);
        commands.iter().find_map(|command| {
            let before = command.get(first.saturating_sub(1))?;
            let behind = command.get(after + 1)?;
            (behind != before).then_some(if behind > before {
                StepDirection::Up
            } else {
                StepDirection::Down
            })
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
