//! Third differences of neighbouring samples: they forget what moves like a parabola, and leave white noise.

use super::thresholds::THRESHOLDS;
use crate::cancel;

/// Sum of squares of the third difference's weights 1, -3, 3, -1: its variance over that of white noise.
pub(crate) const THIRD_DIFFERENCE: f64 = 20.0;

/// Sizes of the third differences of samples `stride` apart within each piece, of values that are there. Of a long record samples far
/// apart are looked at in one place out of several.
pub(crate) fn third_differences<'a>(
    pieces: impl Iterator<Item = &'a [f64]> + Clone,
    is_there: impl Fn(&f64) -> bool,
    stride: usize,
) -> Vec<f64> {
    cancel::check();
    let length: usize = pieces.clone().map(<[f64]>::len).sum();
    let share = if stride > 1 { length / THRESHOLDS.enough_differences + 1 } else { 1 };
    let four = |from: &[f64]| [from[0], from[stride], from[2 * stride], from[3 * stride]];
    let difference = |[a, b, c, d]: [f64; 4]| (d - 3.0 * c + 3.0 * b - a).abs();
    // Without room for all, it would be copied each time that it has grown to twice its length.
    let mut differences = Vec::with_capacity(length / share);
    for piece in pieces.clone() {
        let fours = piece.windows(3 * stride + 1);
        let mut add = |from: &[f64]| {
            let four = four(from);
            if four.iter().all(&is_there) {
                differences.push(difference(four));
            }
        };
        // Steps of one, which most are, take longer by an iterator that asks how long they are.
        if share == 1 { fours.for_each(add) } else { fours.step_by(share).for_each(&mut add) }
    }
    let there = || pieces.clone().map(|piece| piece.iter().copied().filter(&is_there));
    // A sensor slower than the rows hardly ever has four values in a row: then its own rows count.
    if THRESHOLDS.in_a_row * share * differences.len() < there().map(Iterator::count).sum() {
        let own = there().map(|values| values.collect::<Vec<f64>>());
        let of = |own: Vec<f64>| {
            own.windows(3 * stride + 1).step_by(share).map(four).map(difference).collect::<Vec<f64>>()
        };
        differences = own.flat_map(of).collect();
    }
    differences
}
