//! A gyroscope that stops telling: the same reading for far longer than this one ever repeats itself.
//!
//! Of a rotor its command has to be asked, too, which is for who knows what it does. A body may rest: at zero it does, and
//! where its angle stands as well.

use std::ops::Range;

use serde::Serialize;

use super::told;
use crate::record::dataset::Dataset;

/// How unlikely a run of equal values must be, over the whole channel, to be called frozen.
const CHANCE: f64 = 1e-3;
/// No run shorter than this is called frozen.
const LEAST: usize = 10;
/// The channel that is looked at, and the one that knows better.
const RATE: &str = "body_rate_rad_s";
const ANGLE: &str = "body_angle_rad";
/// Share of the angle's whole range by which it must move meanwhile.
const MOVES: f64 = 0.02;

/// Readings of a gyroscope that stood still.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stuck {
    /// Rows that repeat the one before, from 0.
    #[serde(skip)]
    pub rows: Vec<usize>,
    /// How many they are.
    pub cells: usize,
    /// Stretches in which it stood.
    pub places: usize,
    /// [s] longest of them: from, to.
    pub longest_s: [f64; 2],
    /// [rad/s] what it read there.
    pub value: f64,
}

impl Stuck {
    /// In words.
    pub(super) fn sentence(&self, name: &str) -> String {
        let [from, to] = self.longest_s;
        let places = if self.places == 1 {
            String::new()
        } else {
            format!(", and in {} more places", self.places - 1)
        };
        format!(
            "`{name}` is frozen from {from:.1} to {to:.1} s at {}{places}: it was not measured there, and what fits a model takes \
             the {} readings as missing",
            told(self.value, 4),
            self.cells
        )
    }
}

/// Stretches of a channel that were not measured; `None` where there are none.
pub(super) fn find(log: &Dataset, name: &str, values: &[f64]) -> Option<Stuck> {
    if name != RATE {
        return None;
    }
    let known: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_finite()).collect();
    let readings: Vec<f64> = known.iter().map(|row| values[*row]).collect();
    let runs: Vec<&[usize]> = frozen(&readings)
        .into_iter()
        .map(|run| &known[run])
        .filter(|run| values[run[0]] != 0.0 && !rests(log, run))
        .collect();
    let longest = runs.iter().max_by_key(|run| run.len())?;
    let (from, to) = (longest[0], longest[longest.len() - 1]);
    // The first of them was a measurement.
    let rows: Vec<usize> = runs.iter().flat_map(|run| &run[1..]).copied().collect();
    Some(Stuck {
        cells: rows.len(),
        places: runs.len(),
        longest_s: [log.time()[from], log.time()[to]],
        value: values[from],
        rows,
    })
}

/// Whether the body's angle stands over these rows, too.
fn rests(log: &Dataset, rows: &[usize]) -> bool {
    let range = |angles: &mut dyn Iterator<Item = f64>| {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = angles
            .filter(|angle| angle.is_finite())
            .fold(ends, |(low, high), angle| (low.min(angle), high.max(angle)));
        high - low
    };
    log.column(ANGLE).is_some_and(|angle| {
        range(&mut rows.iter().map(|row| angle[*row])) < MOVES * range(&mut angle.iter().copied())
    })
}

/// Runs of equal values, by place, that are too long for a channel that repeats itself as often as this one does.
pub(in crate::record) fn frozen(values: &[f64]) -> Vec<Range<usize>> {
    let pairs = values.len().saturating_sub(1);
    let equal = values.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if pairs == 0 || equal == 0 {
        return Vec::new();
    }
    // A run of n equal values has about the chance share^(n - 1) at each place.
    let share = equal as f64 / pairs as f64;
    let run = (CHANCE / pairs as f64).ln() / share.ln();
    let least = (run.ceil() as usize).saturating_add(1).max(LEAST);
    let mut at = 0;
    let runs = values.chunk_by(|a, b| a == b).map(|run| {
        at += run.len();
        at - run.len()..at
    });
    runs.filter(|run| run.len() >= least).collect()
}
