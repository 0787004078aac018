//! Cells of a log that are no measurements: readings that a logger wrote again because the next one had not come yet,
//! a gyroscope that stands still, readings at the end of a sensor's range, and single wild ones. Only of what is measured: commands and the battery may well be held; the battery's zeros are none, either.
//!
//! `import` reports them and leaves them in. What fits a model to a log takes them as missing: [`measured`].

use std::borrow::Cow;

use serde::Serialize;

use super::{battery_range, frozen_gyro, outliers, sample_and_hold, saturation};
use crate::estimation::quantile::median;
use crate::log::dataset::Dataset;
use crate::screening::Finding;
use crate::unit::short;

#[cfg(test)]
mod tests;

pub use super::battery_range::Empty;
pub use super::frozen_gyro::Stuck;
pub use super::outliers::Wild;
pub use super::sample_and_hold::Repeats;
pub use super::saturation::{Clip, Clipped};

/// Channels whose readings are looked at.
const MEASURED: [&str; 7] = [
    battery_range::BATTERY,
    "propeller_rate_1_rad_s",
    "propeller_rate_2_rad_s",
    "thrust_1_n",
    "thrust_2_n",
    "body_rate_rad_s",
    "body_angle_rad",
];

/// What of a channel is no measurement.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Unmeasured {
    /// Readings that stand in several rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats: Option<Repeats>,
    /// Readings that stood still for too long.
    #[serde(rename = "stands_still", skip_serializing_if = "Option::is_none")]
    pub stuck: Option<Stuck>,
    /// Readings at the end of what the sensor can tell.
    #[serde(rename = "at_its_end", skip_serializing_if = "Option::is_none")]
    pub clipped: Option<Clipped>,
    /// Single readings far from their neighbours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wild: Option<Wild>,
    /// Readings that no battery has.
    #[serde(rename = "reads_empty", skip_serializing_if = "Option::is_none")]
    pub empty: Option<Empty>,
}

impl Unmeasured {
    /// Looks through a channel of a log.
    #[must_use]
    pub fn of(log: &Dataset, name: &str) -> Self {
        let Some(values) = log.column(name).filter(|_| MEASURED.contains(&name)) else {
            return Self::default();
        };
        if name == battery_range::BATTERY {
            return Self { empty: battery_range::find(values), ..Self::default() };
        }
        let repeats = sample_and_hold::find(log, values);
        let mut fresh = values.to_vec();
        repeats.iter().flat_map(|repeats| &repeats.rows).for_each(|row| fresh[*row] = f64::NAN);
        let clipped = saturation::find(&fresh, command_of(log, name));
        let mut within = values.to_vec();
        for row in clipped.iter().flat_map(|clipped| &clipped.rows) {
            (fresh[*row], within[*row]) = (f64::NAN, f64::NAN);
        }
        let stuck = frozen_gyro::find(log, name, &within);
        stuck.iter().flat_map(|stuck| &stuck.rows).for_each(|row| fresh[*row] = f64::NAN);
        // Beside an end neighbours foretell what cannot be read.
        let wild = outliers::find(log, &fresh, command_of(log, name)).filter(|_| clipped.is_none());
        Self { repeats, stuck, clipped, wild, empty: None }
    }

    /// Rows whose cells hold no measurement.
    pub fn rows(&self) -> impl Iterator<Item = usize> + '_ {
        let repeated = self.repeats.iter().flat_map(|repeats| repeats.rows.iter().copied());
        let stuck = self.stuck.iter().flat_map(|stuck| stuck.rows.iter().copied());
        let clipped =
            self.clipped.iter().flat_map(|clipped| clipped.rows.iter().chain(&clipped.beside).copied());
        repeated
            .chain(stuck)
            .chain(clipped)
            .chain(self.wild.iter().flat_map(|wild| wild.rows.iter().copied()))
            .chain(self.empty.iter().flat_map(|empty| empty.rows.iter().copied()))
    }

    /// The same in sentences; `interval` [s] is the log's own.
    #[must_use]
    pub fn sentences(&self, name: &str, interval: f64) -> Vec<String> {
        let repeats = self.repeats.iter().map(|repeats| repeats.sentence(name, interval));
        let stuck = self.stuck.iter().map(|stuck| stuck.sentence(name));
        let clipped = self.clipped.iter().map(|clipped| clipped.sentence(name));
        let wild = self.wild.iter().map(|wild| wild.sentence(name));
        let empty = self.empty.iter().map(|empty| empty.sentence(name));
        repeats.chain(stuck).chain(clipped).chain(wild).chain(empty).collect()
    }
}

/// The command of the rotor that a channel is about.
fn command_of<'a>(log: &'a Dataset, name: &str) -> Option<&'a [f64]> {
    let rotor = |number: &&&str| name.contains(&format!("_{number}_"));
    ["1", "2"].iter().find(rotor).and_then(|number| log.column(&format!("command_{number}")))
}

/// The log with the cells that are no measurements taken as missing; of each channel it is said which.
pub fn measured<'a>(log: &'a Dataset, told: &mut Vec<Finding>) -> Cow<'a, Dataset> {
    let mut cleaned = Cow::Borrowed(log);
    for name in MEASURED {
        let found = Unmeasured::of(log, name);
        let sentences = found.sentences(name, log.median_interval());
        told.extend(sentences.into_iter().map(|sentence| Finding::from(sentence).of(log.source_name())));
        let mut values = log.column(name).unwrap_or_default().to_vec();
        let mut taken = 0;
        for row in found.rows() {
            values[row] = f64::NAN;
            taken += 1;
        }
        if taken > 0 {
            // As long as the column it replaces.
            let _ = cleaned.to_mut().replace(name, values);
        }
    }
    cleaned
}

/// The same of several logs.
pub fn measured_all<'a>(logs: &'a [Dataset], told: &mut Vec<Finding>) -> Cow<'a, [Dataset]> {
    let mut cleaned = Cow::Borrowed(logs);
    for (at, log) in logs.iter().enumerate() {
        if let Cow::Owned(log) = measured(log, told) {
            cleaned.to_mut()[at] = log;
        }
    }
    cleaned
}

/// Intervals of a channel over which what lies between two of its readings is a straight line; over more it is not known.
const BRIDGED: f64 = 4.5;

/// The channel with straight lines over missing cells, where its readings come at a pace and only a few are missing. For
/// what a channel drives; nothing is judged by what lies on such a line.
#[must_use]
pub fn bridged(time: &[f64], values: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_finite()).collect();
    let mut bridged = values.to_vec();
    let intervals = known.windows(2).map(|pair| time[pair[1]] - time[pair[0]]);
    let Some(pace) = median(intervals) else { return bridged };
    for pair in known.windows(2).filter(|pair| pair[1] > pair[0] + 1) {
        let (from, to) = (pair[0], pair[1]);
        let span = time[to] - time[from];
        if span > BRIDGED * pace {
            continue;
        }
        for row in from + 1..to {
            bridged[row] = values[from] + (values[to] - values[from]) * (time[row] - time[from]) / span;
        }
    }
    bridged
}

/// A number for people: so many digits of it.
pub(crate) fn told(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scale = 10f64.powi(digits - 1 - value.abs().log10().floor() as i32);
    short((value * scale).round() / scale)
}
