//! What screening found, as stretches of time: drawn behind the curves of the channel that it was found in. Of a rotor's rate
//! also where it is not held against a model, as at standstill.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Serialize;

use super::thresholds::THRESHOLDS;
use crate::log::Dataset;
use crate::log::dataset::Hole;
use crate::screening::ScreenedLog;
use crate::signal::columns;

/// What was found in the channels of a log, and where. Taken once: to look through millions of rows takes longer than to draw.
#[derive(Debug)]
pub(super) struct Bands {
    found: Vec<Found>,
    holes: Vec<Hole>,
    /// [s] the log's usual interval.
    pub interval: f64,
}

#[derive(Debug)]
struct Found {
    channel: String,
    code: &'static str,
    /// Rows, from 0, ascending.
    rows: Vec<usize>,
}

/// One band.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Band {
    /// Code of the finding; `hole` where there are no rows.
    pub code: &'static str,
    /// [s] where it begins.
    pub from: f64,
    /// [s] where it ends.
    pub to: f64,
}

impl Bands {
    /// Those of a screened log.
    pub fn of(screened: &ScreenedLog) -> Self {
        let mut found = Vec::new();
        for channel in screened.channels() {
            for judged in &channel.judgements {
                let mut rows: Vec<usize> = judged.rows.iter().chain(&judged.biased).copied().collect();
                rows.sort_unstable();
                rows.dedup();
                found.push(Found { channel: channel.name.clone(), code: judged.finding.code, rows });
            }
        }
        let log = screened.raw();
        for rotor in screened.rotors() {
            let channel = columns::propeller_rate(rotor.number());
            // The channel's own are there already.
            let is_new =
                |code: &&str| !found.iter().any(|it: &Found| it.channel == channel && it.code == *code);
            let rows = (0..log.len()).filter_map(|row| Some((rotor.reason(row).filter(is_new)?, row)));
            let mut reasons: BTreeMap<&'static str, Vec<usize>> = BTreeMap::new();
            rows.for_each(|(code, row)| reasons.entry(code).or_default().push(row));
            let all = reasons.into_iter().map(|(code, rows)| Found { channel: channel.clone(), code, rows });
            found.extend(all.collect::<Vec<_>>());
        }
        Self { found, holes: log.holes(), interval: log.median_interval() }
    }

    /// The bands of these channels among `rows` of the log, and its holes; what is closer than `pixel` [s] is one.
    pub fn within(&self, log: &Dataset, rows: &Range<usize>, channels: &[&str], pixel: f64) -> Vec<Band> {
        let time = log.time();
        let half = 0.5 * self.interval;
        let mut bands = Vec::new();
        for found in self.found.iter().filter(|found| channels.contains(&found.channel.as_str())) {
            let first = found.rows.partition_point(|row| *row < rows.start);
            let last = found.rows.partition_point(|row| *row < rows.end);
            let each = found.rows[first..last].iter().filter_map(|row| time.get(*row));
            let spans = each.map(|at| (at - half, at + half));
            push(&mut bands, found.code, spans, pixel);
        }
        let seen = |at: usize| (rows.start..rows.end).contains(&at);
        let holes = self.holes.iter().filter(|hole| seen(hole.after) || seen(hole.after + 1));
        push(&mut bands, "hole", holes.map(|hole| (hole.start, hole.start + hole.length)), pixel);
        bands
    }
}

fn push(bands: &mut Vec<Band>, code: &'static str, spans: impl Iterator<Item = (f64, f64)>, pixel: f64) {
    let first = bands.len();
    for (from, to) in spans {
        // What a picture cannot show apart is one band to its end.
        let is_full = bands.len() - first >= THRESHOLDS.most_bands;
        match bands[first..].last_mut() {
            Some(last) if is_full || from - last.to < pixel => last.to = to,
            _ => bands.push(Band { code, from, to }),
        }
    }
}
