//! Lines of a residual: frequencies at which it swings, whatever the channels do.

use super::thresholds::THRESHOLDS;
use crate::diagnose::block_data::{BlockData, Runs};
use crate::estimation::line_spectrum::{self, LineSearch, Piece};

/// [rad/s] the lines that explain most of the residual's first channel, the strongest first.
pub(crate) fn lines(data: &BlockData, residuals: &[f64]) -> Vec<f64> {
    let search = LineSearch {
        fewest_turns: THRESHOLDS.fewest_turns,
        apart: THRESHOLDS.lines_apart,
        most: THRESHOLDS.lines,
        tries_per_turn: THRESHOLDS.tries_per_turn,
        highest: THRESHOLDS.highest_line,
        most_tried: THRESHOLDS.most_lines_tried,
    };
    line_spectrum::lines(&pieces(data, residuals), search)
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
        let (time, residual) = pairs.unzip();
        Piece::new(time, residual)
    };
    times.into_iter().zip(data.pieces(0)).map(of).filter(|piece| piece.len() > 2).collect()
}
