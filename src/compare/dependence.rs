//! What an error depends on: the share of it that is a function of a channel, beside what surrogates (the channel shifted in
//! time) reach; and which channel it follows in time.

use std::fmt;

use serde::{Serialize, Serializer};

use super::thresholds::THRESHOLDS;
use crate::estimation::cross_correlation::{CrossCorrelation, Peak};
use crate::estimation::dependence::BinnedDependence;
use crate::estimation::slope::centred_slopes;
use crate::log::Dataset;
use crate::screening::readings;

/// Samples to both sides over which a channel's rate of change is taken.
pub(crate) const REACH: usize = 2;

/// A column of the log or its rate of change; `d/dt COLUMN` in the JSON.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Regressor {
    /// Column.
    pub column: String,
    /// Whether it is the column's rate of change.
    pub is_rate: bool,
}

impl fmt::Display for Regressor {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{}{}", if self.is_rate { "d/dt " } else { "" }, self.column)
    }
}

impl Serialize for Regressor {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// How much of an error is a function of one channel, or of its rate of change.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dependence {
    /// What it depends on.
    #[cfg_attr(test, schemars(with = "String"))]
    pub on: Regressor,
    /// [-] share of the error's variance that the mean over the channel's bins carries.
    pub explained: f64,
    /// [-] share of the error's variance expected by chance: the largest that the same channel reached when it was shifted in
    /// time, so that it means nothing. `luck` in the JSON.
    #[serde(rename = "luck")]
    pub surrogate: f64,
    /// Middle of each bin, in the channel's unit, and mean error there, in the error's unit.
    #[serde(skip)]
    pub curve: Vec<(f64, f64)>,
}

impl Dependence {
    /// Whether it is more than chance explains.
    #[must_use]
    pub fn is_real(&self) -> bool {
        self.explained > self.surrogate + THRESHOLDS.least_dependence
    }
}

/// Which of two signals goes ahead.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// The error follows the channel: evidence of something missing also in closed loop.
    ErrorFollows,
    /// The error leads: in closed loop the controller's answer to the error looks like this.
    ErrorLeads,
}

/// Where the cross-correlation of an error with a channel is largest.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Correlation {
    /// Column.
    pub with: String,
    /// [-] largest correlation by size.
    pub peak: f64,
    /// [s] by how much the error comes later than the channel there.
    pub lag_s: f64,
    /// Who goes ahead.
    pub direction: Direction,
    /// [-] size that a hundredth of unrelated signals of the same colour would pass.
    pub bound: f64,
}

/// Every channel of the log and its rate, the strongest dependence first. `rows` are the rows of the log that
/// the error belongs to, in order; `error` its values there.
pub(crate) fn dependences(log: &Dataset, rows: &[usize], error: &[f64]) -> Vec<Dependence> {
    let mut found = Vec::new();
    for name in log.names() {
        let Some(values) = log.column(name) else { continue };
        let values = readings::bridged(log.time(), values);
        let at_rows: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
        found.extend(dependence((name, false), &at_rows, error));
        let mut rate = vec![f64::NAN; log.len()];
        for segment in log.segments() {
            let slopes = centred_slopes(&log.time()[segment.clone()], &values[segment.clone()], REACH);
            rate[segment].copy_from_slice(&slopes);
        }
        let at_rows: Vec<f64> = rows.iter().map(|row| rate[*row]).collect();
        found.extend(dependence((name, true), &at_rows, error));
    }
    found.sort_by(|a, b| (b.explained - b.surrogate).total_cmp(&(a.explained - a.surrogate)));
    found
}

fn dependence((column, is_rate): (&str, bool), channel: &[f64], error: &[f64]) -> Option<Dependence> {
    let BinnedDependence { explained, surrogate, curve } =
        BinnedDependence::of(channel, error, THRESHOLDS.bins, THRESHOLDS.surrogates)?;
    let on = Regressor { column: column.to_owned(), is_rate };
    Some(Dependence { on, explained, surrogate, curve })
}

/// Cross-correlation of the error with every channel, the strongest over its bound first.
pub(crate) fn correlations(log: &Dataset, rows: &[usize], error: &[f64], interval: f64) -> Vec<Correlation> {
    let of_error = CrossCorrelation::of(error, THRESHOLDS.most_lag);
    let mut found: Vec<Correlation> = log
        .names()
        .filter_map(|name| {
            let values = log.column(name)?;
            let channel: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
            let Peak { lag, correlation, standard_error } = of_error.with(&channel)?;
            Some(Correlation {
                with: name.to_owned(),
                peak: correlation,
                lag_s: lag as f64 * interval,
                direction: if lag >= 0 { Direction::ErrorFollows } else { Direction::ErrorLeads },
                bound: THRESHOLDS.correlation_bound * standard_error,
            })
        })
        .collect();
    found.sort_by(|a, b| (b.peak.abs() / b.bound).total_cmp(&(a.peak.abs() / a.bound)));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log() -> (Dataset, Vec<f64>) {
        let time: Vec<f64> = (0..3_000).map(|k| 0.01 * f64::from(k)).collect();
        let angle: Vec<f64> = time.iter().map(|t| (1.3 * t).sin() + 0.3 * (3.1 * t).cos()).collect();
        let mut log = Dataset::new("here", "", time.clone()).unwrap();
        log.insert("body_angle_rad", angle.clone()).unwrap();
        log.insert("battery_voltage_v", time.iter().map(|t| 12.5 - 0.01 * t).collect()).unwrap();
        (log, angle)
    }

    #[test]
    fn an_error_that_is_a_function_of_a_channel_is_said_to_be() {
        let (log, angle) = log();
        let rows: Vec<usize> = (0..log.len()).collect();
        let error: Vec<f64> = angle.iter().map(|a| -0.4 * a.sin()).collect();
        let found = dependences(&log, &rows, &error);
        assert_eq!(found[0].on.to_string(), "body_angle_rad");
        assert!(found[0].explained > 0.95 && found[0].is_real(), "{:?}", found[0]);
        let (low, high) = (found[0].curve[0], found[0].curve[found[0].curve.len() - 1]);
        assert!(low.0 < 0.0 && low.1 > 0.0 && high.0 > 0.0 && high.1 < 0.0, "the curve shows the law");
    }

    #[test]
    fn a_drift_is_not_taken_for_anything_but_what_drifts() {
        let (log, _) = log();
        let rows: Vec<usize> = (0..log.len()).collect();
        let error: Vec<f64> = rows.iter().map(|k| ((k * 7_919) % 1_000) as f64 / 1_000.0 - 0.5).collect();
        assert!(dependences(&log, &rows, &error).iter().all(|d| !d.is_real()), "noise depends on nothing");
    }

    #[test]
    fn the_lag_says_who_goes_ahead() {
        let (log, angle) = log();
        let rows: Vec<usize> = (0..log.len()).collect();
        // The error repeats the angle 0.1 s later.
        let error: Vec<f64> = (0..angle.len()).map(|k| angle[k.saturating_sub(10)]).collect();
        let found = correlations(&log, &rows, &error, 0.01);
        let angle = found.iter().find(|c| c.with == "body_angle_rad").unwrap();
        assert!((angle.lag_s - 0.1).abs() < 1e-9 && angle.direction == Direction::ErrorFollows, "{angle:?}");
        assert!(angle.peak > 0.99 && angle.peak.abs() > angle.bound);
    }
}
