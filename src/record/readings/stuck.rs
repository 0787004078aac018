//! A gyroscope that stops telling: the same reading for far longer than this one ever repeats itself.
//!
//! Of a rotor its command has to be asked, too, which is for who knows what it does. A body may rest: at zero it does, and
//! where its angle stands as well.

use serde::Serialize;

use super::told;
use crate::record::dataset::Dataset;
use crate::record::findings::frozen;

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
    let time = log.time();
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let ends = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        ends.1 - ends.0
    };
    let rests = |rows: &std::ops::Range<usize>| {
        log.column(ANGLE).is_some_and(|angle| {
            range(&mut angle[rows.clone()].iter().copied()) < MOVES * range(&mut angle.iter().copied())
        })
    };
    let present: Vec<(f64, f64, usize)> = (0..values.len())
        .filter(|row| values[*row].is_finite())
        .map(|row| (time[row], values[row], row))
        .collect();
    let mut found: Vec<(std::ops::Range<usize>, f64)> = frozen(name, &present)
        .iter()
        .filter(|stretch| stretch.value != 0.0)
        .map(|stretch| {
            let from = time.partition_point(|time| *time < stretch.start_s);
            // The first of them was a measurement.
            let to = time.partition_point(|time| *time <= stretch.start_s + stretch.length_s + 1e-9);
            (from + 1..to, stretch.value)
        })
        .collect();
    found.retain(|(rows, _)| !rests(rows));
    let (longest, value) = found.iter().max_by_key(|(rows, _)| rows.len())?;
    let is_there = |row: &usize| values[*row].is_finite();
    let rows: Vec<usize> = found.iter().flat_map(|(rows, _)| rows.clone()).filter(is_there).collect();
    Some(Stuck {
        cells: rows.len(),
        places: found.len(),
        longest_s: [time[longest.start - 1], time[longest.end - 1]],
        value: *value,
        rows,
    })
}
