//! An error, or the torque that a model lacks, over any channel of the log: its mean where the channel is about so large, and a
//! band about it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::ActError;
use super::desk::{Desk, OpenLog};
use super::plots::UNKNOWN_TORQUE;
use super::shown::ShownComparison;
use super::thresholds::THRESHOLDS;
use crate::log::signals::log_signal;

/// What a page asks for.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AgainstQuery {
    /// Number of the log.
    log: u64,
    /// A block of the model, with its signal; or `unknown_torque`.
    block: String,
    signal: String,
    /// Channel of the log.
    channel: String,
}

/// What it gets, of one model.
#[derive(Debug, Serialize)]
pub(super) struct Against {
    model: u64,
    /// Unit of the error, and of the channel.
    unit: &'static str,
    channel_unit: &'static str,
    /// Samples that count.
    samples: usize,
    places: Vec<Place>,
}

/// Samples of about the same value of the channel, as many as in every other place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Place {
    /// Mean of the channel, in its unit.
    at: f64,
    /// Mean of the error, in its unit.
    mean: f64,
    /// Half the band's width: of a torque the rms of its standard error, of an error its standard deviation.
    band: f64,
}

/// Taken from the desk under its lock, made without it.
pub(super) struct AgainstTask {
    query: AgainstQuery,
    content: Arc<OpenLog>,
    models: Vec<u64>,
    found: Arc<Vec<ShownComparison>>,
}

impl AgainstTask {
    /// What the desk has of it.
    pub fn of(desk: &Desk, query: AgainstQuery) -> Result<Self, ActError> {
        let compared = desk.log(query.log)?.compared.as_ref();
        let found = compared.and_then(|it| Some((it, it.found.as_ref().ok()?)));
        let (compared, found) = found.ok_or(ActError::Nothing("no model was compared with this log"))?;
        let (content, models) = (Arc::clone(&compared.content), compared.models.clone());
        Ok(Self { query, content, models, found: Arc::clone(found) })
    }

    /// Makes it.
    pub fn answer(&self) -> Vec<Against> {
        let AgainstQuery { block, signal, channel, .. } = &self.query;
        let log = self.content.log.raw();
        let Some(values) = log.column(channel) else { return Vec::new() };
        let channel_unit = log_signal(channel).map_or("", |known| known.unit);
        let of_model = |(model, shown): (&u64, &ShownComparison)| {
            let comparison = &shown.comparison;
            let (unit, samples) = if block == UNKNOWN_TORQUE {
                let torque = comparison.unknown_torque.as_ref()?;
                let each = torque.rows.iter().zip(torque.torque.iter().zip(&torque.standard_error));
                ("N m", thinned(each.map(|(row, (torque, error))| (values[row], *torque, Some(*error)))))
            } else {
                let block = comparison.blocks.iter().find(|it| it.name == *block && it.signal == *signal)?;
                let each = block.trace.rows().iter().enumerate();
                let error = |(sample, row)| (values[row], block.trace.residual_at(sample, row), None);
                (block.unit, thinned(each.map(error)))
            };
            let count = samples.len();
            Some(Against { model: *model, unit, channel_unit, samples: count, places: places(samples) })
        };
        self.models.iter().zip(self.found.iter()).filter_map(of_model).collect()
    }
}

/// Value of the channel, of the error, and its standard error where it has one of its own.
type Sample = (f64, f64, Option<f64>);

/// Samples that have both; of many, evenly spaced ones only.
fn thinned(samples: impl Iterator<Item = Sample>) -> Vec<Sample> {
    let mut kept: Vec<Sample> = Vec::new();
    let mut stride = 1;
    let known = samples.filter(|(at, error, _)| at.is_finite() && error.is_finite());
    for (number, sample) in known.enumerate() {
        if number % stride == 0 {
            kept.push(sample);
        }
        if kept.len() > THRESHOLDS.most_against {
            let mut at = 0;
            kept.retain(|_| {
                at += 1;
                at % 2 == 1
            });
            stride *= 2;
        }
    }
    kept
}

/// Parts of equal count along the channel; samples of one value share one.
fn places(mut samples: Vec<Sample>) -> Vec<Place> {
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let size = samples.len().div_ceil(THRESHOLDS.places_against).max(1);
    let mut places = Vec::new();
    let mut from = 0;
    while from < samples.len() {
        let mut to = (from + size).min(samples.len());
        while to < samples.len() && samples[to].0 == samples[to - 1].0 {
            to += 1;
        }
        places.push(place(&samples[from..to]));
        from = to;
    }
    places
}

fn place(samples: &[Sample]) -> Place {
    let count = samples.len() as f64;
    let mean_of = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / count;
    let mean = mean_of(&|it| it.1);
    let square = mean_of(&|it| it.2.map_or((it.1 - mean).powi(2), |error| error * error));
    Place { at: mean_of(&|it| it.0), mean, band: square.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_shows_along_its_channel_and_the_band_is_what_lies_beside_it() {
        let sample = |k: usize| (k as f64 / 240.0, if k.is_multiple_of(2) { 1.0 } else { -1.0 });
        let law = |at: f64| 0.3 * at;
        let samples = (0..2400).map(sample).map(|(at, noise)| (at, law(at) + 0.5 * noise, None));
        let found = places(samples.collect());
        assert_eq!(found.len(), THRESHOLDS.places_against);
        for Place { at, mean, band } in &found {
            assert!((mean - law(*at)).abs() < 1e-9, "{mean} at {at}");
            // The noise, and what the law itself does within a part.
            assert!((0.5..0.51).contains(band), "{band}");
        }
        let own = places((0..100).map(|k| (f64::from(k), 7.0, Some(0.25))).collect());
        assert!(own.iter().all(|it| (it.mean, it.band) == (7.0, 0.25)), "{own:?}");
    }

    #[test]
    fn samples_of_one_value_share_a_place_and_many_are_thinned() {
        let levels = places((0..1000).map(|k| (f64::from(k % 3), 1.0, None)).collect());
        assert_eq!(levels.iter().map(|it| it.at).collect::<Vec<_>>(), [0.0, 1.0, 2.0]);
        let many = 5 * THRESHOLDS.most_against;
        let kept = thinned((0..many).map(|k| (k as f64, 1.0, None)));
        assert!(kept.len() <= THRESHOLDS.most_against && kept.len() > THRESHOLDS.most_against / 2);
        let even = |pair: &[Sample]| pair[1].0 - pair[0].0 == 8.0;
        assert!(kept.windows(2).all(even), "evenly over all of it");
        assert!(thinned([(f64::NAN, 1.0, None), (1.0, f64::NAN, None)].into_iter()).is_empty());
        assert!(places(Vec::new()).is_empty());
    }
}
