//! What an error depends on: the share of it that is a function of a channel, beside what surrogates (the channel shifted in
//! time) reach; and which channel it follows in time.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

use serde::{Serialize, Serializer};

use super::related_rows::{ErrorOn, Related};
use super::thresholds::THRESHOLDS;
use crate::cancel;
use crate::estimation::cross_correlation::{Coloured, Peak};
use crate::estimation::dependence::{BinnedDependence, Bins};
use crate::estimation::slope::{centred_slope, centred_slopes_within};
use crate::log::Dataset;
use crate::screening::readings;
use crate::threads::spread;

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
    /// time, so that it means nothing. `by_chance` in the JSON.
    #[serde(rename = "by_chance")]
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

/// What an error has to do with the channels of its log.
#[derive(Default)]
pub(crate) struct Relations {
    /// With every channel and its rate, the strongest first.
    pub dependences: Vec<Dependence>,
    /// With every channel in time, the strongest over its bound first.
    pub correlations: Vec<Correlation>,
}

/// What each error has to do with every channel of the log, whose rows are `interval` [s] apart.
pub(crate) fn relations(log: &Dataset, errors: &[&Related], interval: f64) -> Vec<Relations> {
    let in_time: Vec<ErrorOn> = errors.iter().map(|error| error.in_time()).collect();
    let scattered: Vec<ErrorOn> = errors.iter().map(|error| error.scattered()).collect();
    let coloured = spread(&in_time, |error| Coloured::of(error.values, THRESHOLDS.most_lag));
    let [rows, places] = [SharedRows::of(&in_time), SharedRows::of(&scattered)];
    let names: Vec<&str> = log.names().filter(|name| log.has(name)).collect();
    let is_part = errors.iter().any(|error| error.is_part());
    let found = spread(&names, |name| {
        let Some(values) = log.cells(name).map(|cells| cells.for_once()) else { return Vec::new() };
        let mut found: Vec<Relations> = errors.iter().map(|_| Relations::default()).collect();
        correlated((name, &values), (&in_time, &coloured, &rows), interval, &mut found);
        depending(log, (name, &values), (&scattered, &places), is_part, &mut found);
        found
    });
    let mut relations: Vec<Relations> = errors.iter().map(|_| Relations::default()).collect();
    for of_channel in found {
        for (all, one) in relations.iter_mut().zip(of_channel) {
            all.dependences.extend(one.dependences);
            all.correlations.extend(one.correlations);
        }
    }
    for Relations { dependences, correlations } in &mut relations {
        dependences.sort_by(|a, b| (b.explained - b.surrogate).total_cmp(&(a.explained - a.surrogate)));
        correlations.sort_by(|a, b| (b.peak.abs() / b.bound).total_cmp(&(a.peak.abs() / a.bound)));
    }
    relations
}

/// Which errors have rows, and which have values, in the same places: what a channel is there needs to be found only once.
struct SharedRows {
    /// For each error the first one with its rows.
    rows: Vec<usize>,
    /// For each error the first one that is there in the same of the same rows.
    places: Vec<usize>,
}

impl SharedRows {
    fn of(errors: &[ErrorOn]) -> Self {
        let first = |at: usize, is_same: &dyn Fn(&ErrorOn) -> bool| {
            errors[..at].iter().position(is_same).unwrap_or(at)
        };
        let rows = |at: usize| first(at, &|other| other.rows == errors[at].rows);
        let is_same = |a: &ErrorOn, b: &ErrorOn| {
            let mut pairs = a.values.iter().zip(b.values);
            a.rows == b.rows && pairs.all(|(a, b)| a.is_finite() == b.is_finite())
        };
        let places = |at: usize| first(at, &|other| is_same(other, &errors[at]));
        Self { rows: (0..errors.len()).map(rows).collect(), places: (0..errors.len()).map(places).collect() }
    }

    /// The errors over the same rows as `first`, the first of them.
    fn group(of: &[usize], first: usize) -> impl Iterator<Item = usize> {
        (first..of.len()).filter(move |at| of[*at] == first)
    }
}

/// With which lag each error follows one channel.
fn correlated(
    (name, values): (&str, &[f64]),
    (errors, coloured, shared): (&[ErrorOn], &[Coloured], &SharedRows),
    interval: f64,
    found: &mut [Relations],
) {
    for first in (0..errors.len()).filter(|at| shared.rows[*at] == *at) {
        let channel = at_rows(values, errors[first].rows);
        let channel = Coloured::of(&channel, THRESHOLDS.most_lag);
        for at in SharedRows::group(&shared.rows, first) {
            let peak = coloured[at].with(&channel);
            found[at].correlations.extend(peak.map(|peak| correlation(name, peak, interval)));
        }
    }
}

/// Each error as a function of one channel, and of its rate.
fn depending(
    log: &Dataset,
    (name, values): (&str, &[f64]),
    (errors, shared): (&[ErrorOn], &SharedRows),
    is_part: bool,
    found: &mut [Relations],
) {
    let bridged = readings::bridged(log.time(), values);
    let on = |is_rate| Regressor { column: name.to_owned(), is_rate };
    binned(&on(false), |rows| at_rows(&bridged, rows), errors, shared, found);
    let (time, segments, reach) = (log.time(), log.segments(), THRESHOLDS.rate_reach);
    // Of a part not every row's rate is worth taking.
    let rates = (!is_part).then(|| centred_slopes_within(time, &bridged, &segments, reach));
    let rate_at = |row: usize| -> Option<f64> {
        let piece = segments.get(segments.partition_point(|piece| piece.end <= row))?;
        let at = row.checked_sub(piece.start)?;
        Some(centred_slope(&time[piece.clone()], &bridged[piece.clone()], at, reach))
    };
    let rates_at = |rows: &[Range<usize>]| match &rates {
        Some(rates) => at_rows(rates, rows),
        None => rows.iter().cloned().flatten().map(|row| rate_at(row).unwrap_or(f64::NAN)).collect(),
    };
    binned(&on(true), rates_at, errors, shared, found);
}

/// Each error as a function of a channel, which may be a rate: of which `channel` gives the values in some rows.
fn binned<'a>(
    on: &Regressor,
    channel: impl Fn(&[Range<usize>]) -> Cow<'a, [f64]>,
    errors: &[ErrorOn],
    shared: &SharedRows,
    found: &mut [Relations],
) {
    for first in (0..errors.len()).filter(|at| shared.places[*at] == *at) {
        let ErrorOn { rows, values } = errors[first];
        let Some(bins) = Bins::of(&channel(rows), values, THRESHOLDS.bins) else { continue };
        for at in SharedRows::group(&shared.places, first) {
            cancel::check();
            let BinnedDependence { explained, surrogate, curve } =
                bins.dependence(errors[at].values, THRESHOLDS.surrogates);
            found[at].dependences.push(Dependence { on: on.clone(), explained, surrogate, curve });
        }
    }
}

/// A column's values in these rows.
pub(crate) fn at_rows<'a>(values: &'a [f64], rows: &[Range<usize>]) -> Cow<'a, [f64]> {
    match rows {
        [rows] => Cow::Borrowed(&values[rows.clone()]),
        rows => rows.iter().flat_map(|rows| &values[rows.clone()]).copied().collect(),
    }
}

fn correlation(with: &str, peak: Peak, interval: f64) -> Correlation {
    let Peak { lag, correlation, standard_error } = peak;
    Correlation {
        with: with.to_owned(),
        peak: correlation,
        lag_s: lag as f64 * interval,
        direction: if lag >= 0 { Direction::ErrorFollows } else { Direction::ErrorLeads },
        bound: THRESHOLDS.correlation_bound * standard_error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log() -> (Dataset, Vec<f64>) {
        let time: Vec<f64> = (0..3_000).map(|k| 0.01 * f64::from(k)).collect();
        let angle: Vec<f64> = time.iter().map(|t| (1.3 * t).sin() + 0.3 * (3.1 * t).cos()).collect();
        let voltage = time.iter().map(|t| 12.5 - 0.01 * t).collect();
        (Dataset::made(time, [("body_angle_rad", angle.clone()), ("battery_voltage_v", voltage)]), angle)
    }

    fn of(log: &Dataset, error: &[f64]) -> Relations {
        let all = 0..error.len();
        relations(log, &[&Related::of(std::slice::from_ref(&all), error.into())], 0.01).remove(0)
    }

    #[test]
    fn an_error_that_is_a_function_of_a_channel_is_said_to_be() {
        let (log, angle) = log();
        let error: Vec<f64> = angle.iter().map(|a| -0.4 * a.sin()).collect();
        let found = of(&log, &error).dependences;
        assert_eq!(found[0].on.to_string(), "body_angle_rad");
        assert!(found[0].explained > 0.95 && found[0].is_real(), "{:?}", found[0]);
        let (low, high) = (found[0].curve[0], found[0].curve[found[0].curve.len() - 1]);
        assert!(low.0 < 0.0 && low.1 > 0.0 && high.0 > 0.0 && high.1 < 0.0, "the curve shows the law");
    }

    #[test]
    fn a_drift_is_not_taken_for_anything_but_what_drifts() {
        let (log, _) = log();
        let error: Vec<f64> = (0..log.len()).map(|k| ((k * 7_919) % 1_000) as f64 / 1_000.0 - 0.5).collect();
        assert!(of(&log, &error).dependences.iter().all(|d| !d.is_real()), "noise depends on nothing");
    }

    #[test]
    fn the_lag_says_who_goes_ahead() {
        let (log, angle) = log();
        // The error repeats the angle 0.1 s later.
        let error: Vec<f64> = (0..angle.len()).map(|k| angle[k.saturating_sub(10)]).collect();
        let found = of(&log, &error).correlations;
        let angle = found.iter().find(|c| c.with == "body_angle_rad").unwrap();
        assert!((angle.lag_s - 0.1).abs() < 1e-9 && angle.direction == Direction::ErrorFollows, "{angle:?}");
        assert!(angle.peak > 0.99 && angle.peak.abs() > angle.bound);
    }

    /// Errors that share rows or places share work: each gets what it gets alone.
    #[test]
    fn several_errors_get_what_each_gets_alone() {
        let (log, angle) = log();
        let first: Vec<f64> = angle.iter().map(|a| a.sin()).collect();
        let every_other: Vec<f64> =
            angle.iter().enumerate().map(|(k, a)| if k % 2 == 0 { a * a } else { f64::NAN }).collect();
        let rows = [std::slice::from_ref(&(0..3_000)), &[5..1_000, 1_001..2_996]];
        let late: Vec<f64> = rows[1].iter().flat_map(|rows| &first[rows.clone()]).copied().collect();
        let errors = [(rows[0], &first), (rows[0], &every_other), (rows[1], &late), (rows[0], &angle)];
        let errors = errors.map(|(rows, values)| Related::of(rows, values.into()));
        for (error, found) in errors.iter().zip(relations(&log, &errors.each_ref(), 0.01)) {
            let alone = relations(&log, &[error], 0.01).remove(0);
            assert_eq!((found.dependences, found.correlations), (alone.dependences, alone.correlations));
        }
    }
}
