//! Where a block fails: over time, at rest and in motion, slow and fast, and with which channels.

use std::borrow::Cow;
use std::ops::Range;

use serde::Serialize;

use super::dependence::{Correlation, Dependence};
use super::spectrum::{Spectrum, spectrum};
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::quantile;
use crate::estimation::slope::centred_slopes_within;
use crate::screening::readings;

/// Where a block fails.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Middle [s] of equal stretches of time, and rms of the error there, in the signal's unit.
    pub over_time: Vec<(f64, f64)>,
    /// The error where the modelled signal rests, rises and falls.
    pub groups: Vec<Regime>,
    /// The error over frequency.
    pub spectrum: Option<Spectrum>,
    /// What it depends on, the strongest first; for the body, what the unknown torque depends on.
    pub dependences: Vec<Dependence>,
    /// Cross-correlation with every channel, the strongest first.
    pub correlations: Vec<Correlation>,
}

/// The error over samples of one kind.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Regime {
    /// `steady`, `rising`, `falling`.
    pub name: &'static str,
    /// Samples of this kind.
    pub samples: usize,
    /// Rms of the error there, in the signal's unit.
    pub rms: f64,
    /// Mean of the error there, in the signal's unit.
    pub mean: f64,
    /// [-] share of the whole squared error.
    pub share: f64,
}

impl Failure {
    /// What can be said from the signals of the block alone; `corner_hz` parts slow from fast.
    pub(crate) fn of(
        time: &[f64],
        modelled: &[f64],
        residual: &[f64],
        pieces: &[Range<usize>],
        interval: f64,
        corner_hz: f64,
    ) -> Self {
        // Windows that follow each other are one piece to the spectrum.
        let mut joined: Vec<Range<usize>> = Vec::new();
        for piece in pieces {
            let near = |last: &Range<usize>| {
                time[piece.start] - time[last.end - 1] < THRESHOLDS.joined_gap * interval
            };
            match joined.last_mut() {
                Some(last) if last.end == piece.start && near(last) => last.end = piece.end,
                _ => joined.push(piece.clone()),
            }
        }
        Self {
            over_time: over_time(time, residual),
            groups: groups(time, modelled, residual, pieces),
            spectrum: patchy_spectrum(time, &joined, residual, interval, corner_hz),
            dependences: Vec::new(),
            correlations: Vec::new(),
        }
    }
}

/// The spectrum of an error of which samples are missing: a few, or those of a sensor that tells in every second, third or
/// fourth row only.
fn patchy_spectrum(
    time: &[f64],
    pieces: &[Range<usize>],
    residual: &[f64],
    interval: f64,
    corner_hz: f64,
) -> Option<Spectrum> {
    let missing = residual.iter().filter(|error| !error.is_finite()).count();
    if (missing as f64) < THRESHOLDS.few_missing * residual.len() as f64 {
        let whole = |piece: &Range<usize>| readings::bridged(&time[piece.clone()], &residual[piece.clone()]);
        let whole: Vec<Cow<[f64]>> = pieces.iter().map(whole).collect();
        return spectrum(whole.iter().map(|piece| &piece[..]), interval, corner_hz);
    }
    (1..=THRESHOLDS.widest_stride).find_map(|stride| {
        let own = pieces.iter().map(|piece| -> Vec<f64> {
            let piece = &residual[piece.clone()];
            let first = piece.iter().position(|value| value.is_finite()).unwrap_or(0);
            piece[first..].iter().step_by(stride).copied().collect()
        });
        let own: Vec<Vec<f64>> = own.collect();
        spectrum(own.iter().map(Vec::as_slice), stride as f64 * interval, corner_hz)
    })
}

fn over_time(time: &[f64], residual: &[f64]) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (time.first(), time.last()) else { return Vec::new() };
    let length = (last - first) / THRESHOLDS.stretches_shown as f64;
    let mut sums = [(0.0, 0.0); THRESHOLDS.stretches_shown];
    for (at, error) in time.iter().zip(residual).filter(|(_, error)| error.is_finite()) {
        let sum = &mut sums[(((at - first) / length) as usize).min(THRESHOLDS.stretches_shown - 1)];
        sum.0 += error * error;
        sum.1 += 1.0;
    }
    let middles = (0..THRESHOLDS.stretches_shown).map(|number| first + (number as f64 + 0.5) * length);
    // A stretch without samples is a hole: not-a-number.
    middles.zip(sums).map(|(at, (sum, count)): (f64, (f64, f64))| (at, (sum / count).sqrt())).collect()
}

fn groups(time: &[f64], modelled: &[f64], residual: &[f64], pieces: &[Range<usize>]) -> Vec<Regime> {
    let slopes = centred_slopes_within(time, modelled, pieces, THRESHOLDS.rate_reach);
    let Some(fast) = quantile(slopes.iter().map(|slope| slope.abs()), THRESHOLDS.fast_share) else {
        return Vec::new();
    };
    let rest = THRESHOLDS.at_rest * fast;
    let total: f64 = residual.iter().filter(|error| error.is_finite()).map(|error| error * error).sum();
    // Of each slope: 0 steady, 1 rising, 2 falling.
    let kind = |slope: f64| if slope.abs() <= rest { 0 } else { 1 + usize::from(slope < 0.0) };
    let mut sums = [(0, 0.0, 0.0); 3];
    for (slope, error) in slopes.iter().zip(residual).filter(|(slope, e)| slope.is_finite() && e.is_finite())
    {
        let (samples, sum, squares) = &mut sums[kind(*slope)];
        *samples += 1;
        *sum += error;
        *squares += error * error;
    }
    let group = |(name, (samples, sum, squares)): (&'static str, (usize, f64, f64))| {
        let count = samples as f64;
        let share = if total > 0.0 { squares / total } else { 0.0 };
        Regime { name, samples, rms: (squares / count).sqrt(), mean: sum / count, share }
    };
    let named = ["steady", "rising", "falling"].into_iter().zip(sums);
    named.map(group).filter(|group| group.samples > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_and_motion_up_and_down_are_told_apart() {
        // Up over the second second, down over the fourth, at rest between.
        let time: Vec<f64> = (0..500).map(|k| 0.01 * f64::from(k)).collect();
        let modelled: Vec<f64> =
            time.iter().map(|t| (t - 1.0).clamp(0.0, 1.0) - (t - 3.0).clamp(0.0, 1.0)).collect();
        let residual: Vec<f64> =
            time.iter().map(|t| if (1.0..2.0).contains(t) { 3.0 } else { 0.0 }).collect();
        let found = groups(&time, &modelled, &residual, std::slice::from_ref(&(0..500)));
        let named = |name: &str| found.iter().find(|group| group.name == name).unwrap();
        assert!(named("rising").rms > 2.9 && named("rising").share > 0.97, "{found:?}");
        assert!(named("falling").rms == 0.0 && named("steady").rms < 0.5, "{found:?}");
        let worst = over_time(&time, &residual).into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((1.0..2.0).contains(&worst.0));
    }
}
