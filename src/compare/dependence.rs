//! What an error depends on: the share of it that is a function of a channel, held against surrogates (the channel shifted in time); and which
//! channel it follows in time.

use serde::Serialize;

use super::thresholds::THRESHOLDS;
use crate::estimation::slope::centred_slopes;
use crate::log::Dataset;
use crate::screening::readings;

/// Samples to both sides over which a channel's rate of change is taken.
pub(crate) const REACH: usize = 2;

/// How much of an error is a function of one channel, or of its rate of change.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dependence {
    /// Column; `d/dt` in front where it is the column's rate.
    pub on: String,
    /// [-] share of the error's variance that the mean over the channel's bins carries.
    pub explained: f64,
    /// [-] the largest share that the same channel reached, shifted in time so that it means nothing; `luck` in the JSON.
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
        found.extend(dependence(name.to_owned(), &at_rows, error));
        let mut rate = vec![f64::NAN; log.len()];
        for segment in log.segments() {
            let slopes = centred_slopes(&log.time()[segment.clone()], &values[segment.clone()], REACH);
            rate[segment].copy_from_slice(&slopes);
        }
        let at_rows: Vec<f64> = rows.iter().map(|row| rate[*row]).collect();
        found.extend(dependence(format!("d/dt {name}"), &at_rows, error));
    }
    found.sort_by(|a, b| (b.explained - b.surrogate).total_cmp(&(a.explained - a.surrogate)));
    found
}

/// `None` when the channel hardly moves or is mostly missing.
fn dependence(on: String, channel: &[f64], error: &[f64]) -> Option<Dependence> {
    let mut order: Vec<usize> =
        (0..error.len()).filter(|k| channel[*k].is_finite() && error[*k].is_finite()).collect();
    let known = error.iter().filter(|error| error.is_finite()).count();
    if order.len() < 4 * THRESHOLDS.bins || 2 * order.len() < known {
        return None;
    }
    let kept = order.clone();
    order.sort_by(|a, b| channel[*a].total_cmp(&channel[*b]));
    if channel[order[0]] == channel[order[order.len() - 1]] {
        return None;
    }
    let mut bin_of = vec![0; error.len()];
    for (rank, k) in order.iter().enumerate() {
        bin_of[*k] = rank * THRESHOLDS.bins / order.len();
    }
    // Samples of one value share a bin, or the order of the file would decide.
    for pair in order.windows(2) {
        if channel[pair[0]] == channel[pair[1]] {
            bin_of[pair[1]] = bin_of[pair[0]];
        }
    }
    let errors: Vec<f64> = kept.iter().map(|k| error[*k]).collect();
    let bins: Vec<usize> = kept.iter().map(|k| bin_of[*k]).collect();
    let (explained, means) = share(&bins, &errors, 0);
    let surrogate = (1..=THRESHOLDS.surrogates).map(|number| {
        // Shifts spread over the middle nine tenths of the record: none is near to no shift at all.
        let part = 0.05 + 0.9 * number as f64 / (THRESHOLDS.surrogates + 1) as f64;
        share(&bins, &errors, (part * errors.len() as f64) as usize).0
    });
    let surrogate = surrogate.fold(0.0, f64::max);
    let curve = (0..THRESHOLDS.bins).filter_map(|bin| {
        let inside: Vec<f64> = order.iter().filter(|k| bin_of[**k] == bin).map(|k| channel[*k]).collect();
        let middle = *inside.get(inside.len() / 2)?;
        Some((middle, means[bin]))
    });
    Some(Dependence { on, explained, surrogate, curve: curve.collect() })
}

/// Share of the variance of `errors` that the bins' means carry, with the channel `shift` samples aside;
/// corrected for what that many means carry of anything.
fn share(bins: &[usize], errors: &[f64], shift: usize) -> (f64, [f64; THRESHOLDS.bins]) {
    let count = errors.len() as f64;
    let mut sums = [(0.0, 0.0); THRESHOLDS.bins];
    for (k, error) in errors.iter().enumerate() {
        let bin = bins[(k + shift) % bins.len()];
        sums[bin].0 += error;
        sums[bin].1 += 1.0;
    }
    let mean = errors.iter().sum::<f64>() / count;
    let total: f64 = errors.iter().map(|error| (error - mean).powi(2)).sum();
    let means = sums.map(|(sum, number): (f64, f64)| if number > 0.0 { sum / number } else { 0.0 });
    let between: f64 = sums.iter().zip(means).map(|((_, number), m)| number * (m - mean).powi(2)).sum();
    if total <= 0.0 {
        return (0.0, means);
    }
    let used = sums.iter().filter(|(_, number)| *number > 0.0).count() as f64;
    let within = (total - between) / (count - used);
    ((1.0 - within / (total / (count - 1.0))).max(0.0), means)
}

/// Cross-correlation of the error with every channel, the strongest over its bound first.
pub(crate) fn correlations(log: &Dataset, rows: &[usize], error: &[f64], interval: f64) -> Vec<Correlation> {
    let centred_error = centred(error);
    let colour = autocorrelation(&centred_error);
    let known = error.iter().filter(|error| error.is_finite()).count();
    let mut found: Vec<Correlation> = log
        .names()
        .filter_map(|name| {
            let values = log.column(name)?;
            let channel = centred(&rows.iter().map(|row| values[*row]).collect::<Vec<f64>>());
            let other = autocorrelation(&channel);
            // Bartlett: the variance of a correlation between two coloured signals that are unrelated.
            let stretch: f64 = 1.0 + 2.0 * colour.iter().zip(&other).skip(1).map(|(a, b)| a * b).sum::<f64>();
            let bound = THRESHOLDS.correlation_bound * (stretch.max(1.0) / known as f64).sqrt();
            let (lag, peak) = peak(&centred_error, &channel)?;
            let direction = if lag >= 0 { Direction::ErrorFollows } else { Direction::ErrorLeads };
            Some(Correlation { with: name.to_owned(), peak, lag_s: lag as f64 * interval, direction, bound })
        })
        .collect();
    found.sort_by(|a, b| (b.peak.abs() / b.bound).total_cmp(&(a.peak.abs() / a.bound)));
    found
}

/// Mean taken off, missing values as the mean, size one.
fn centred(values: &[f64]) -> Vec<f64> {
    let good: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mean = good.iter().sum::<f64>() / good.len().max(1) as f64;
    let size = good.iter().map(|value| (value - mean).powi(2)).sum::<f64>().sqrt();
    let scale = if size > 0.0 { 1.0 / size } else { 0.0 };
    values.iter().map(|value| if value.is_finite() { (value - mean) * scale } else { 0.0 }).collect()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn autocorrelation(values: &[f64]) -> Vec<f64> {
    (0..=4 * THRESHOLDS.most_lag.min(values.len() / 8)).map(|lag| product(values, &values[lag..])).collect()
}

/// Correlation over the samples that two signals share.
fn overlapping(a: &[f64], b: &[f64]) -> f64 {
    let both = a.len().min(b.len());
    let (a, b) = (&a[..both], &b[..both]);
    let size = (product(a, a) * product(b, b)).sqrt();
    if size > 0.0 { product(a, b) / size } else { 0.0 }
}

/// Lag in samples, positive where the error comes later, and correlation there.
fn peak(error: &[f64], channel: &[f64]) -> Option<(i64, f64)> {
    let most = THRESHOLDS.most_lag.min(error.len() / 8);
    let later = (0..=most).map(|lag| (lag as i64, overlapping(&error[lag..], channel)));
    let earlier = (1..=most).map(|lag| (-(lag as i64), overlapping(error, &channel[lag..])));
    later.chain(earlier).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).filter(|(_, peak)| *peak != 0.0)
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
        assert_eq!(found[0].on, "body_angle_rad");
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
