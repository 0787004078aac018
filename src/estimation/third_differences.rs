//! Third differences of neighbouring samples: they forget what moves like a parabola, and leave white noise.

use super::thresholds::THRESHOLDS;

/// Sum of squares of the third difference's weights 1, -3, 3, -1: its variance over that of white noise.
pub(crate) const THIRD_DIFFERENCE: f64 = 20.0;

/// Sizes of the third differences within each piece, of values that are there.
pub(crate) fn third_differences<'a>(
    pieces: impl Iterator<Item = &'a [f64]> + Clone,
    is_there: impl Fn(&f64) -> bool,
) -> Vec<f64> {
    let difference = |four: &[f64]| (four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).abs();
    let fours = pieces.clone().flat_map(|piece| piece.windows(4));
    let mut differences: Vec<f64> = fours.filter(|four| four.iter().all(&is_there)).map(difference).collect();
    let there = || pieces.clone().map(|piece| piece.iter().copied().filter(&is_there));
    // A sensor slower than the rows hardly ever has four values in a row: then its own rows count.
    if THRESHOLDS.in_a_row * differences.len() < there().map(Iterator::count).sum() {
        let own = there().map(|values| values.collect::<Vec<f64>>());
        differences = own.flat_map(|own| own.windows(4).map(difference).collect::<Vec<f64>>()).collect();
    }
    differences
}
