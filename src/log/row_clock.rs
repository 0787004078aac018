//! Channels with clocks of their own, put into rows of one: nothing is interpolated, and no value is moved further than half
//! an interval of the fastest clock.

use crate::estimation::quantile::{median_step, sorted};

/// The rows that hold the stamps of several clocks, and where each stamp went.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rows {
    /// [s] the rows, rising.
    pub time: Vec<f64>,
    /// Of each clock the row of each stamp.
    pub places: Vec<Vec<usize>>,
    /// [s] the furthest that a stamp was moved.
    pub greatest_shift: f64,
}

/// Merges clocks [s], each rising. The fastest one gives the rows; a stamp of another goes to the nearest row where that is
/// within half an interval of the fastest, and becomes a row of its own elsewhere.
pub(crate) fn merge(clocks: &[&[f64]]) -> Rows {
    let fastest = clocks.iter().max_by_key(|clock| clock.len()).copied().unwrap_or(&[]);
    let half = 0.5 * median_step(fastest.iter().copied()).unwrap_or(0.0);
    let others = clocks.iter().filter(|clock| !std::ptr::eq(**clock, fastest));
    let others = others.flat_map(|clock| clock.iter().copied());
    let mut own =
        sorted(others.filter(|stamp| distance(fastest, *stamp).is_none_or(|(_, apart)| apart > half)));
    // Stamps of several clocks that are as near to each other share a row, too.
    let mut last = f64::NEG_INFINITY;
    own.retain(|stamp| {
        let is_apart = *stamp - last > half;
        if is_apart {
            last = *stamp;
        }
        is_apart
    });
    let mut time = sorted(fastest.iter().copied().chain(own));
    time.dedup();
    let mut greatest_shift = 0.0_f64;
    let places = clocks.iter().map(|clock| {
        let place = |stamp: &f64| {
            let (row, apart) = distance(&time, *stamp).unwrap_or((0, 0.0));
            greatest_shift = greatest_shift.max(apart);
            row
        };
        clock.iter().map(place).collect()
    });
    let places = places.collect();
    Rows { time, places, greatest_shift }
}

/// The nearest of rising stamps, and how far it is.
fn distance(stamps: &[f64], at: f64) -> Option<(usize, f64)> {
    let behind = stamps.partition_point(|stamp| *stamp < at);
    let sides = [behind.checked_sub(1), Some(behind)];
    let near = sides.into_iter().flatten().filter_map(|row| Some((row, (stamps.get(row)? - at).abs())));
    near.min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_stamps_go_to_the_nearest_row_of_the_fast_clock() {
        let fast: Vec<f64> = (0..10).map(|k| 0.01 * f64::from(k)).collect();
        let rows = merge(&[&[0.021, 0.049], &fast]);
        assert_eq!(rows.time, fast);
        assert_eq!(rows.places[0], [2, 5]);
        assert_eq!(rows.places[1], (0..10).collect::<Vec<_>>());
        assert!((rows.greatest_shift - 0.001).abs() < 1e-12);
    }

    #[test]
    fn what_no_row_is_near_to_becomes_one() {
        let fast = [0.0, 0.01, 0.02, 0.5, 0.51, 0.52];
        let rows = merge(&[&fast, &[0.2, 0.3], &[0.201]]);
        assert_eq!(rows.time, [0.0, 0.01, 0.02, 0.2, 0.3, 0.5, 0.51, 0.52]);
        assert_eq!(rows.places, [vec![0, 1, 2, 5, 6, 7], vec![3, 4], vec![3]]);
    }

    #[test]
    fn one_clock_and_none_are_as_they_are() {
        assert_eq!(merge(&[&[1.0, 2.0]]).time, [1.0, 2.0]);
        assert!(merge(&[]).time.is_empty());
        assert_eq!(merge(&[&[], &[1.0]]).places, [vec![], vec![0]]);
    }
}
