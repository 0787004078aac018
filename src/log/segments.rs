//! Stretches of a log over which a block can run: no hole in time, every measured input known.

use std::ops::Range;

use super::dataset::Dataset;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::median;

/// A stretch: its rows, and the inputs over them, each held until its next value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct InputStretch {
    /// Rows of the log.
    pub rows: Range<usize>,
    /// Inputs in the order asked for, one value a row.
    pub inputs: Vec<Vec<f64>>,
}

/// Stretches of `log` where all `inputs` are known. A channel slower than the log is held between its
/// samples; a channel that stops ends the stretch, because holding on would invent data.
pub(crate) fn stretches(log: &Dataset, inputs: &[&[f64]]) -> Vec<InputStretch> {
    let time = log.time();
    let held: Vec<Vec<f64>> = inputs.iter().map(|values| hold(time, values)).collect();
    let mut rows = Vec::new();
    for segment in log.segments() {
        let mut start = segment.start;
        while start < segment.end {
            let known = |row: usize| held.iter().all(|values| values.get(row).is_some_and(|v| v.is_finite()));
            let Some(first) = (start..segment.end).find(|row| known(*row)) else { break };
            let end = (first..segment.end).find(|row| !known(*row)).unwrap_or(segment.end);
            if end - first > 1 {
                rows.push(first..end);
            }
            start = end;
        }
    }
    match &rows[..] {
        // Mostly all of the log: nothing to copy.
        [all] if all.len() == time.len() => vec![InputStretch { rows: all.clone(), inputs: held }],
        rows => {
            let cut = |rows: &Range<usize>| held.iter().map(|values| values[rows.clone()].to_vec()).collect();
            rows.iter().map(|rows| InputStretch { rows: rows.clone(), inputs: cut(rows) }).collect()
        }
    }
}

/// The rows that both have, of ranges that ascend and do not overlap: more than one in each.
pub(crate) fn common(one: &[Range<usize>], other: &[Range<usize>]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let (mut a, mut b) = (0, 0);
    while let (Some(first), Some(second)) = (one.get(a), other.get(b)) {
        let rows = first.start.max(second.start)..first.end.min(second.end);
        if rows.len() > 1 {
            found.push(rows);
        }
        if first.end <= second.end { a += 1 } else { b += 1 }
    }
    found
}

/// A value for every sample: missing cells hold the value before, leading ones the first; zeros where there is none.
pub(crate) fn held_throughout(values: &[f64]) -> Vec<f64> {
    held_or(values, 0.0)
}

/// The same, `otherwise` where there is none.
pub(crate) fn held_or(values: &[f64], otherwise: f64) -> Vec<f64> {
    let mut last = values.iter().copied().find(|value| value.is_finite()).unwrap_or(otherwise);
    let held = values.iter().map(|value| {
        if value.is_finite() {
            last = *value;
        }
        last
    });
    held.collect()
}

/// Each value held until the next, but not for longer than the channel's own interval allows.
fn hold(time: &[f64], values: &[f64]) -> Vec<f64> {
    if values.iter().all(|value| value.is_finite()) {
        return values.to_vec();
    }
    let mut stamps = time.iter().zip(values).filter(|(_, value)| value.is_finite()).map(|(at, _)| *at);
    let intervals = stamps.next().map(|first| {
        stamps.scan(first, |before, at| {
            let interval = at - *before;
            *before = at;
            Some(interval)
        })
    });
    let usual = median(intervals.into_iter().flatten()).unwrap_or(0.0);
    let mut newest = (f64::NEG_INFINITY, f64::NAN);
    let known = time.iter().zip(values).map(|(at, value)| {
        if value.is_finite() {
            newest = (*at, *value);
        }
        if at - newest.0 <= THRESHOLDS.input_hold * usual { newest.1 } else { *value }
    });
    known.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_channels_are_held_and_dead_ones_end_the_stretch() {
        let time: Vec<f64> = (0..40).map(f64::from).collect();
        let command = vec![0.5; 40];
        // Read every fourth second, and no more after the 20th.
        let battery: Vec<f64> =
            (0..40).map(|k| if k % 4 == 2 && k <= 20 { 12.0 } else { f64::NAN }).collect();
        let log = Dataset::new("here", "", time).unwrap();
        let found = stretches(&log, &[&command, &battery]);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].rows, 2..29, "from its first value to 2.5 of its intervals behind its last (18)");
        assert!(found[0].inputs[1].iter().all(|v| *v == 12.0));
    }

    #[test]
    fn what_two_have_in_common_is_cut_where_either_is() {
        assert_eq!(common(&[0..10, 12..20], &[5..14, 14..15, 17..30]), [5..10, 12..14, 17..20]);
        assert!(common(&[], std::slice::from_ref(&(0..9))).is_empty());
    }

    #[test]
    fn nothing_is_carried_across_a_hole() {
        let time = vec![0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 12.0];
        let log = Dataset::new("here", "", time.clone()).unwrap();
        let values = vec![1.0, 1.0, 1.0, 1.0, f64::NAN, f64::NAN, 2.0];
        let found = stretches(&log, &[&values]);
        assert_eq!(found.iter().map(|stretch| stretch.rows.len()).collect::<Vec<_>>(), [4]);
    }
}
