//! Samples cut into windows of a length of time, one after the other. What becomes of the end of a record, and of samples that
//! are missing, each use wants otherwise.

use std::ops::Range;

/// Windows that touch no other: each goes on until `horizon` has passed, and for `fewest` samples. A rest shorter than the share
/// `least_rest` [-] of the horizon joins none.
pub(crate) fn apart(time: &[f64], horizon: f64, fewest: usize, least_rest: f64) -> Vec<Range<usize>> {
    let mut windows = Vec::new();
    let mut from = 0;
    while let Some(begin) = time.get(from) {
        let length = time[from..].iter().take_while(|at| **at - begin < horizon).count();
        let to = from + length.max(fewest);
        if to > time.len() || time.last().is_some_and(|last| last - begin < least_rest * horizon) {
            break;
        }
        windows.push(from..to);
        from = to;
    }
    windows
}

/// Windows that end in the sample with which the next one begins, as simulations do that start from what was measured: at a
/// sample that is `known`. The last one is as long as what is left.
pub(crate) fn joined(
    time: &[f64],
    known: impl Fn(usize) -> bool,
    horizon: f64,
) -> impl Iterator<Item = Range<usize>> {
    let mut from = 0;
    // One by one: those from row to row are as many as the rows.
    std::iter::from_fn(move || {
        let start = (from..time.len()).find(|row| known(*row))?;
        // A billionth of the horizon forgives the rounding of stamps.
        let reached = |row: &usize| time[*row] - time[start] >= horizon * (1.0 - 1e-9);
        let to = (start + 1..time.len()).find(reached);
        from = to.unwrap_or(time.len());
        let window = start..to.map_or(time.len(), |to| to + 1);
        (window.len() > 1).then_some(window)
    })
}

/// The rows of each window, of those that are `known`: of each stretch by itself, and of windows with `fewest` rows or more.
pub(crate) fn of_known(
    time: &[f64],
    known: impl Fn(usize) -> bool,
    stretches: &[Range<usize>],
    horizon: f64,
    fewest: usize,
) -> Vec<Vec<usize>> {
    let mut windows: Vec<Vec<usize>> = Vec::new();
    for stretch in stretches.iter().cloned() {
        let mut window: Vec<usize> = Vec::new();
        for row in stretch.filter(|&row| known(row)) {
            if window.first().is_some_and(|&first| time[row] - time[first] >= horizon) {
                windows.push(std::mem::take(&mut window));
            }
            window.push(row);
        }
        windows.push(window);
    }
    windows.retain(|window| window.len() >= fewest);
    windows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quarters(count: usize) -> Vec<f64> {
        (0..count).map(|at| 0.25 * at as f64).collect()
    }

    #[test]
    fn windows_apart_leave_a_short_rest() {
        assert_eq!(apart(&quarters(12), 1.0, 2, 0.5), [0..4, 4..8, 8..12]);
        // Of the rest 0.5 s have passed from its first to its last sample.
        assert_eq!(apart(&quarters(11), 1.0, 2, 0.5), [0..4, 4..8, 8..11]);
        assert_eq!(apart(&quarters(10), 1.0, 2, 0.5), [0..4, 4..8]);
        assert_eq!(apart(&quarters(12), 1.0, 5, 0.5), [0..5, 5..10]);
        assert!(apart(&[], 1.0, 2, 0.5).is_empty());
    }

    #[test]
    fn windows_joined_share_their_ends_and_begin_where_something_is_known() {
        let found = |rows, known: fn(usize) -> bool| joined(&quarters(rows), known, 1.0).collect::<Vec<_>>();
        assert_eq!(found(10, |_| true), [0..5, 4..9, 8..10]);
        assert_eq!(found(9, |_| true), [0..5, 4..9]);
        assert_eq!(found(10, |row| row % 4 == 1), [1..6, 5..10]);
        assert_eq!(found(10, |row| row != 4), [0..5, 5..10]);
        assert!(found(10, |_| false).is_empty());
    }

    #[test]
    fn windows_of_what_is_known_stay_within_stretches() {
        let rows = of_known(&quarters(12), |row| row != 2, &[0..5, 5..12], 1.0, 2);
        assert_eq!(rows, [vec![0, 1, 3], vec![5, 6, 7, 8], vec![9, 10, 11]]);
        let rows = of_known(&quarters(12), |row| row != 2, &[0..5, 5..12], 1.0, 4);
        assert_eq!(rows, [vec![5, 6, 7, 8]]);
    }
}
