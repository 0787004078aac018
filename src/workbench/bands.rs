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
    spans: Spans,
}

/// Stretches of time [s], ascending; rows that follow each other are one.
#[derive(Debug, Default)]
struct Spans(Vec<(f64, f64)>);

impl Spans {
    /// Adds a row at this time, half an `interval` to both sides.
    fn take(&mut self, at: f64, interval: f64) {
        let (from, to) = (at - 0.5 * interval, at + 0.5 * interval);
        match self.0.last_mut() {
            Some(last) if from <= last.1 + 0.5 * interval => last.1 = to,
            _ => self.0.push((from, to)),
        }
    }

    fn between(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let first = self.0.partition_point(|span| span.1 < from);
        self.0[first..].iter().copied().take_while(move |span| span.0 <= to)
    }
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
        let log = screened.raw();
        let (time, interval) = (log.time(), log.median_interval());
        let mut found = Vec::new();
        for channel in screened.channels() {
            for judged in &channel.judgements {
                let mut rows: Vec<usize> = judged.rows.iter().chain(&judged.biased).copied().collect();
                rows.sort_unstable();
                let mut spans = Spans::default();
                rows.iter().filter_map(|row| time.get(*row)).for_each(|at| spans.take(*at, interval));
                found.push(Found { channel: channel.name.clone(), code: judged.finding.code, spans });
            }
        }
        for rotor in screened.rotors() {
            let channel = columns::propeller_rate(rotor.number());
            // The channel's own are there already.
            let is_new =
                |code: &&str| !found.iter().any(|it: &Found| it.channel == channel && it.code == *code);
            let mut reasons: BTreeMap<&'static str, Spans> = BTreeMap::new();
            for (row, at) in time.iter().enumerate() {
                if let Some(code) = rotor.reason(row).filter(is_new) {
                    reasons.entry(code).or_default().take(*at, interval);
                }
            }
            let all =
                reasons.into_iter().map(|(code, spans)| Found { channel: channel.clone(), code, spans });
            found.extend(all.collect::<Vec<_>>());
        }
        Self { found, holes: log.holes(), interval }
    }

    /// The bands of these channels among `rows` of the log, and its holes; what is closer than `pixel` [s] is one.
    pub fn within(&self, log: &Dataset, rows: &Range<usize>, channels: &[&str], pixel: f64) -> Vec<Band> {
        let mut bands = Vec::new();
        let Some((first, last)) =
            log.time().get(rows.clone()).and_then(|time| Some((time.first()?, time.last()?)))
        else {
            return bands;
        };
        for found in self.found.iter().filter(|found| channels.contains(&found.channel.as_str())) {
            push(&mut bands, found.code, found.spans.between(*first, *last), pixel);
        }
        let seen = |at: usize| (rows.start..rows.end).contains(&at);
        let holes = self.holes.iter().filter(|hole| seen(hole.after) || seen(hole.after + 1));
        push(&mut bands, "hole", holes.map(|hole| (hole.start, hole.start + hole.length)), pixel);
        bands.sort_by(|one, other| one.from.total_cmp(&other.from));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two findings of a channel and a hole, the later ones first: a picture names them from left to right.
    #[test]
    fn bands_come_in_the_order_of_time_whatever_found_them() {
        let time: Vec<f64> = (0..100).map(f64::from).filter(|at| !(40.0..60.0).contains(at)).collect();
        let log = Dataset::new("here", "", time).expect("a log");
        let found = |code, spans: &[(f64, f64)]| Found {
            channel: "body_rate_rad_s".to_owned(),
            code,
            spans: Spans(spans.to_vec()),
        };
        let found = vec![found("outliers", &[(70.0, 75.0), (90.0, 91.0)]), found("frozen", &[(5.0, 9.0)])];
        let bands = Bands { found, holes: log.holes(), interval: 1.0 };
        let drawn = bands.within(&log, &(0..log.len()), &["body_rate_rad_s"], 0.1);
        let codes: Vec<(&str, f64)> = drawn.iter().map(|it| (it.code, it.from)).collect();
        assert_eq!(codes, [("frozen", 5.0), ("hole", 39.0), ("outliers", 70.0), ("outliers", 90.0)]);
        assert_eq!(
            bands.within(&log, &(0..log.len()), &["body_angle_rad"], 0.1).len(),
            1,
            "another channel's"
        );
    }
}
