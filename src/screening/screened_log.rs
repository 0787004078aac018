//! A log judged once: of each channel which cells are measurements, and why the others are not. Whoever fits a model to a
//! log, compares one with it or describes it takes it from here, so that all see the same rows.

use std::borrow::Cow;

use super::channel::{Channel, Judgement, MEASURED};
use super::{Finding, battery_range, frozen_gyro, outliers, rate_dropouts, sample_and_hold, saturation};
use crate::log::Dataset;

/// A check of one channel.
type Check = fn(&Channel) -> Option<Judgement>;

/// The checks, in the order in which a channel goes through them: each may look at what is left of the ones before. To add
/// one: a file with its function and its code, its line here, and its sentence in `report`.
const CHECKS: [Check; 7] = [
    rate_dropouts::zeros,
    battery_range::check,
    sample_and_hold::check,
    // A rate at the end of its range stands there, too: it is saturated, and not frozen.
    saturation::check,
    rate_dropouts::frozen,
    frozen_gyro::check,
    outliers::check,
];

/// A log, and what of it is no measurement.
#[derive(Debug, Clone)]
pub struct ScreenedLog<'a> {
    cleaned: Cow<'a, Dataset>,
    channels: Vec<ScreenedChannel>,
}

/// What is no measurement in one channel.
#[derive(Debug, Clone)]
pub struct ScreenedChannel {
    /// Name of the channel.
    pub name: &'static str,
    /// What each check found.
    pub judgements: Vec<Judgement>,
}

impl ScreenedChannel {
    fn of(log: &Dataset, name: &'static str) -> Option<Self> {
        let mut channel = Channel::of(log, name)?;
        for check in CHECKS {
            let found = check(&channel);
            channel.found.extend(found);
        }
        Some(Self { name, judgements: channel.found })
    }

    /// What was found in it.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        self.judgements.iter().map(|judged| judged.finding.clone()).collect()
    }

    /// Rows whose cells are left out.
    pub fn left_out(&self) -> impl Iterator<Item = usize> + '_ {
        self.judgements.iter().flat_map(|judged| judged.rows.iter().chain(&judged.biased).copied())
    }

    /// Why the cell of this row is no measurement: the code of the finding; `None` of one that is, or is empty.
    #[must_use]
    pub fn reason(&self, row: usize) -> Option<&'static str> {
        let holds = |judged: &&Judgement| judged.rows.contains(&row) || judged.biased.contains(&row);
        self.judgements.iter().find(holds).map(|judged| judged.finding.code)
    }

    /// Whether a check found this.
    #[must_use]
    pub fn has(&self, code: &str) -> bool {
        self.judgements.iter().any(|judged| judged.finding.code == code)
    }
}

impl<'a> ScreenedLog<'a> {
    /// Judges a log.
    #[must_use]
    pub fn of(log: &'a Dataset) -> Self {
        let channels: Vec<ScreenedChannel> =
            MEASURED.iter().filter_map(|name| ScreenedChannel::of(log, name)).collect();
        let mut cleaned = Cow::Borrowed(log);
        for channel in channels.iter().filter(|channel| channel.left_out().next().is_some()) {
            let mut values = log.column(channel.name).unwrap_or_default().to_vec();
            channel.left_out().for_each(|row| values[row] = f64::NAN);
            // As long as the column it replaces.
            let _ = cleaned.to_mut().replace(channel.name, values);
        }
        Self { cleaned, channels }
    }

    /// The log with every cell missing that is no measurement.
    #[must_use]
    pub fn dataset(&self) -> &Dataset {
        &self.cleaned
    }

    /// The channels that were looked at.
    #[must_use]
    pub fn channels(&self) -> &[ScreenedChannel] {
        &self.channels
    }

    /// The channel of this name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&ScreenedChannel> {
        self.channels.iter().find(|channel| channel.name == name)
    }

    /// What was found, channel by channel.
    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.channels.iter().flat_map(|channel| &channel.judgements).map(|judged| &judged.finding)
    }
}

/// The same of several logs: what is left of each, and what was found is added to `findings`.
pub fn screened<'a>(logs: &'a [Dataset], findings: &mut Vec<Finding>) -> Cow<'a, [Dataset]> {
    let mut cleaned = Cow::Borrowed(logs);
    for (at, log) in logs.iter().enumerate() {
        let screened = ScreenedLog::of(log);
        findings.extend(screened.findings().cloned());
        if let Cow::Owned(log) = screened.cleaned {
            cleaned.to_mut()[at] = log;
        }
    }
    cleaned
}
