//! Lines of a signal: the frequencies at which it swings, by least squares, so that samples may come unevenly and in pieces (the
//! periodogram of Lomb 1976 and Scargle 1982, with a mean of its own for each piece).

use super::moments::mean;
use super::quantile::{extremes, median};
use crate::threads::spread;

/// A stretch of a signal, its mean taken off.
pub(crate) struct Piece {
    /// [s]
    time: Vec<f64>,
    values: Vec<f64>,
}

/// Which lines are asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LineSearch {
    /// count: turns that the slowest makes over the whole signal.
    pub fewest_turns: f64,
    /// count: turns over the whole signal by which two lines differ at the least.
    pub apart: f64,
    /// count: how many.
    pub most: usize,
    /// count: frequencies tried for each turn that the whole signal lasts.
    pub tries_per_turn: f64,
    /// [-] share of the samples' rate up to which lines are looked for.
    pub highest: f64,
    /// count: most frequencies that are tried.
    pub most_tried: usize,
}

impl Piece {
    /// Of samples at these times [s]; its mean is taken off.
    pub(crate) fn new(time: Vec<f64>, mut values: Vec<f64>) -> Self {
        let centre = mean(&values);
        values.iter_mut().for_each(|value| *value -= centre);
        Self { time, values }
    }

    /// How many samples it has.
    pub(crate) fn len(&self) -> usize {
        self.time.len()
    }
}

/// [rad/s] the lines that explain most, the strongest first.
pub(crate) fn lines(pieces: &[Piece], search: LineSearch) -> Vec<f64> {
    let (first, last) = extremes(pieces.iter().flat_map(|piece| piece.time.iter().copied()));
    let gaps = pieces.iter().flat_map(|piece| piece.time.windows(2).map(|pair| pair[1] - pair[0]));
    let (span, Some(gap)) = (last - first, median(gaps)) else { return Vec::new() };
    let (low, high) = (search.fewest_turns / span, search.highest / gap);
    if !(low.is_finite() && high.is_finite() && low < high) {
        return Vec::new();
    }
    let step = (1.0 / (search.tries_per_turn * span)).max((high - low) / search.most_tried as f64);
    let count = ((high - low) / step) as usize;
    let frequencies: Vec<f64> =
        (0..count).map(|index| std::f64::consts::TAU * (low + step * index as f64)).collect();
    let powers = spread(&frequencies, |frequency| explained(pieces, *frequency));
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| powers[*b].total_cmp(&powers[*a]));
    let mut found: Vec<f64> = Vec::new();
    for index in order {
        let frequency = frequencies[index];
        // Beside a line its own foot is no other line.
        let is_apart = |known: &f64| (known - frequency).abs() > search.apart * std::f64::consts::TAU / span;
        if found.iter().all(is_apart) {
            found.push(frequency);
        }
        if found.len() >= search.most {
            break;
        }
    }
    found
}

/// The squares that a wave of this frequency [rad/s] and any phase takes off, each piece's mean apart.
fn explained(pieces: &[Piece], frequency: f64) -> f64 {
    let mut sums = [0.0; 5];
    for Piece { time, values } in pieces {
        let waves: Vec<(f64, f64)> = time.iter().map(|time| (frequency * time).sin_cos()).collect();
        let count = waves.len() as f64;
        let (sine, cosine) = waves.iter().fold((0.0, 0.0), |(s, c), wave| (s + wave.0, c + wave.1));
        let (sine, cosine) = (sine / count, cosine / count);
        for ((s, c), value) in waves.iter().zip(values) {
            let (s, c) = (s - sine, c - cosine);
            sums[0] += s * s;
            sums[1] += c * c;
            sums[2] += s * c;
            sums[3] += s * value;
            sums[4] += c * value;
        }
    }
    let [ss, cc, sc, sr, cr] = sums;
    let determinant = ss * cc - sc * sc;
    if determinant > 0.0 { (cc * sr * sr - 2.0 * sc * sr * cr + ss * cr * cr) / determinant } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two waves in two pieces with other means, at uneven times.
    #[test]
    fn two_waves_are_found_across_a_gap_and_a_step_of_the_mean() {
        let piece = |from: f64, level: f64| {
            let time: Vec<f64> =
                (0..600).map(|k| from + 0.02 * f64::from(k) + 0.004 * f64::from(k * 7 % 5)).collect();
            let wave = |t: &f64| level + (9.0 * t).sin() + 0.5 * (23.0 * t).cos();
            let values = time.iter().map(wave).collect();
            Piece::new(time, values)
        };
        let pieces = [piece(0.0, 3.0), piece(20.0, -40.0)];
        let search = LineSearch {
            fewest_turns: 3.0,
            apart: 2.0,
            most: 2,
            tries_per_turn: 3.0,
            highest: 0.25,
            most_tried: 6000,
        };
        let found = lines(&pieces, search);
        // A sixth of a turn over 32 s.
        let off = std::f64::consts::TAU / 6.0 / 32.0;
        assert_eq!(found.len(), 2);
        assert!((found[0] - 9.0).abs() < off && (found[1] - 23.0).abs() < off, "{found:?}");
        assert!(lines(&[], search).is_empty());
    }
}
