//! Lines of a residual: frequencies at which it swings, whatever the channels do.

use super::thresholds::THRESHOLDS;
use crate::diagnose::block_data::{BlockData, Runs};
use crate::estimation::moments::mean;
use crate::estimation::quantile::{extremes, median};
use crate::threads::spread;

/// A stretch of the residual's first channel, its mean taken off.
struct Piece {
    time: Vec<f64>,
    residual: Vec<f64>,
}

/// [rad/s] the lines that explain most, the strongest first.
pub(crate) fn lines(data: &BlockData, residuals: &[f64]) -> Vec<f64> {
    let pieces = pieces(data, residuals);
    let (first, last) = extremes(pieces.iter().flat_map(|piece| piece.time.iter().copied()));
    let gaps = pieces.iter().flat_map(|piece| piece.time.windows(2).map(|pair| pair[1] - pair[0]));
    let (span, Some(gap)) = (last - first, median(gaps)) else { return Vec::new() };
    let (low, high) = (THRESHOLDS.fewest_turns / span, THRESHOLDS.highest_line / gap);
    if !(low.is_finite() && high.is_finite() && low < high) {
        return Vec::new();
    }
    let step =
        (1.0 / (THRESHOLDS.tries_per_turn * span)).max((high - low) / THRESHOLDS.most_lines_tried as f64);
    let count = ((high - low) / step) as usize;
    let frequencies: Vec<f64> =
        (0..count).map(|index| std::f64::consts::TAU * (low + step * index as f64)).collect();
    let powers = spread(&frequencies, |frequency| explained(&pieces, *frequency));
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| powers[*b].total_cmp(&powers[*a]));
    let mut found: Vec<f64> = Vec::new();
    for index in order {
        let frequency = frequencies[index];
        // Beside a line its own foot is no other line.
        let is_apart =
            |known: &f64| (known - frequency).abs() > THRESHOLDS.lines_apart * std::f64::consts::TAU / span;
        if found.iter().all(is_apart) {
            found.push(frequency);
        }
        if found.len() >= THRESHOLDS.lines {
            break;
        }
    }
    found
}

fn pieces(data: &BlockData, residuals: &[f64]) -> Vec<Piece> {
    let times: Vec<&[f64]> = match &data.runs {
        Runs::Rotor(runs) => runs.iter().map(|run| &run.time[..]).collect(),
        Runs::Body(runs) => {
            let windows = runs.iter().flat_map(|run| run.windows.iter().map(move |rows| (run, rows)));
            windows.map(|(run, rows)| &run.input.time[rows.clone()]).collect()
        }
    };
    let of = |(time, rows): (&[f64], std::ops::Range<usize>)| {
        let pairs = time.iter().zip(&residuals[rows]).filter(|(_, residual)| **residual != 0.0);
        let (time, mut residual): (Vec<f64>, Vec<f64>) = pairs.unzip();
        let centre = mean(&residual);
        residual.iter_mut().for_each(|value| *value -= centre);
        Piece { time, residual }
    };
    times.into_iter().zip(data.pieces(0)).map(of).filter(|piece| piece.time.len() > 2).collect()
}

/// The squares that a wave of this frequency [rad/s] and any phase takes off, each piece's mean apart.
fn explained(pieces: &[Piece], frequency: f64) -> f64 {
    let mut sums = [0.0; 5];
    for Piece { time, residual } in pieces {
        let waves: Vec<(f64, f64)> = time.iter().map(|time| (frequency * time).sin_cos()).collect();
        let count = waves.len() as f64;
        let (sine, cosine) = waves.iter().fold((0.0, 0.0), |(s, c), wave| (s + wave.0, c + wave.1));
        let (sine, cosine) = (sine / count, cosine / count);
        for ((s, c), value) in waves.iter().zip(residual) {
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
