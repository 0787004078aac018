//! Short gaps of a channel bridged by straight lines, for what the channel drives.

use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::median;

/// The channel with straight lines over missing cells, where its readings come at a pace and only a few are missing. For
/// what a channel drives; nothing is judged by what lies on such a line.
#[must_use]
pub fn bridged(time: &[f64], values: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_finite()).collect();
    let mut bridged = values.to_vec();
    let intervals = known.windows(2).map(|pair| time[pair[1]] - time[pair[0]]);
    let Some(pace) = median(intervals) else { return bridged };
    for pair in known.windows(2).filter(|pair| pair[1] > pair[0] + 1) {
        let (from, to) = (pair[0], pair[1]);
        let span = time[to] - time[from];
        if span > THRESHOLDS.bridged * pace {
            continue;
        }
        for row in from + 1..to {
            bridged[row] = values[from] + (values[to] - values[from]) * (time[row] - time[from]) / span;
        }
    }
    bridged
}
