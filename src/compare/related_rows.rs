//! Which samples of an error are held beside the channels of its log: all of a short one. Of a long one some say as much, at a
//! fraction of the time: what an error is a function of is asked of samples scattered over all of it, which miss no motion of the
//! log; what follows what in time, of stretches of neighbours spread evenly over it. All errors themselves are of all rows.

use std::borrow::Cow;
use std::ops::Range;

use super::thresholds::THRESHOLDS;
use crate::estimation::scattered::scattered;

/// An error over rows of a log.
#[derive(Clone, Copy)]
pub(crate) struct ErrorOn<'a> {
    /// Rows of the log, in order.
    pub rows: &'a [Range<usize>],
    /// The error in each of them; not-a-number = none.
    pub values: &'a [f64],
}

/// The same, with rows and values of its own.
#[derive(Default)]
pub(crate) struct OwnError {
    rows: Vec<Range<usize>>,
    values: Vec<f64>,
}

impl OwnError {
    /// To be looked at.
    pub(crate) fn on(&self) -> ErrorOn<'_> {
        ErrorOn { rows: &self.rows, values: &self.values }
    }
}

/// The samples of an error that are held beside channels.
pub(crate) struct Related {
    scattered: OwnError,
    /// `None` where all samples are looked at.
    stretches: Option<OwnError>,
}

impl Related {
    /// Of the error over these rows of a log, in order.
    pub(crate) fn of(rows: &[Range<usize>], values: Cow<[f64]>) -> Self {
        let most = THRESHOLDS.most_related_rows;
        if values.len() <= most {
            let values = values.into_owned();
            return Self { scattered: OwnError { rows: rows.to_vec(), values }, stretches: None };
        }
        let places = Places::of(rows);
        let (all, count) = (values.len(), THRESHOLDS.related_stretches);
        let within = |group: usize| {
            let group = group * all / most..(group + 1) * all / most;
            let row = group.start + scattered(group.start) % group.len();
            row..row + 1
        };
        let stretch = |number: usize| {
            let length = most / count;
            let start = (2 * number + 1) * all / (2 * count) - length / 2;
            start..start + length
        };
        Self {
            scattered: places.cut(&values, (0..most).map(within)),
            stretches: Some(places.cut(&values, (0..count).map(stretch))),
        }
    }

    /// For what it is a function of.
    pub(crate) fn scattered(&self) -> ErrorOn<'_> {
        self.scattered.on()
    }

    /// For what it follows in time.
    pub(crate) fn in_time(&self) -> ErrorOn<'_> {
        self.stretches.as_ref().unwrap_or(&self.scattered).on()
    }

    /// Whether only a part of it is looked at.
    pub(crate) fn is_part(&self) -> bool {
        self.stretches.is_some()
    }

    /// How many of its samples are looked at.
    pub(crate) fn samples(&self) -> usize {
        self.scattered.values.len()
    }
}

/// Which row of the log a sample of an error is.
struct Places<'a> {
    rows: &'a [Range<usize>],
    /// The first sample in each range of rows.
    firsts: Vec<usize>,
}

impl<'a> Places<'a> {
    fn of(rows: &'a [Range<usize>]) -> Self {
        let first = |samples: &mut usize, rows: &Range<usize>| {
            Some(std::mem::replace(samples, *samples + rows.len()))
        };
        Self { rows, firsts: rows.iter().scan(0, first).collect() }
    }

    /// The error in these ranges of samples.
    fn cut(&self, values: &[f64], samples: impl Iterator<Item = Range<usize>>) -> OwnError {
        let mut cut = OwnError::default();
        for Range { start, end } in samples {
            let mut from = start;
            while from < end {
                let at = self.firsts.partition_point(|first| *first <= from) - 1;
                let begin = self.rows[at].start + from - self.firsts[at];
                let length = (end - from).min(self.rows[at].end - begin);
                match cut.rows.last_mut() {
                    Some(last) if last.end == begin => last.end += length,
                    _ => cut.rows.push(begin..begin + length),
                }
                cut.values.extend_from_slice(&values[from..from + length]);
                from += length;
            }
        }
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of an error in windows, each with a row left out before it: every sample that is looked at stands beside its own row.
    #[test]
    fn samples_of_a_long_error_keep_their_rows() {
        let windows = 5 * THRESHOLDS.most_related_rows / 9;
        let rows: Vec<Range<usize>> = (0..windows).map(|window| 10 * window + 1..10 * window + 10).collect();
        let error: Vec<f64> = rows.iter().cloned().flatten().map(|row| row as f64).collect();
        let length = error.len();
        let found = Related::of(&rows, error.as_slice().into());
        assert!(found.is_part());
        for ErrorOn { rows, values } in [found.scattered(), found.in_time()] {
            assert_eq!(values.len(), THRESHOLDS.most_related_rows);
            assert!(rows.iter().cloned().flatten().map(|row| row as f64).eq(values.iter().copied()));
        }
        // One of each five, wherever it is in them; stretches of all parts of the log.
        let ErrorOn { values, .. } = found.scattered();
        assert!(values.iter().enumerate().all(|(at, row)| (row * 0.9 - 5.0 * at as f64).abs() < 7.0));
        let ErrorOn { values, .. } = found.in_time();
        let least = values[0] / error[length - 1];
        assert!(least < 1.0 / THRESHOLDS.related_stretches as f64, "{least}");
        let few = Related::of(&rows[..9], error[..81].into());
        assert!(!few.is_part());
        assert_eq!((few.scattered().values, few.in_time().values), (&error[..81], &error[..81]));
    }
}
