//! Rows that are left out of a score, and why: in ranges, for a reason a row would take more memory than the channel itself.

use std::borrow::Cow;
use std::ops::Range;

/// The code: rows in which a rotor stands or starts.
pub(super) const STANDSTILL: &str = "standstill_left_out";
/// The code: rows in which it is not known what was commanded.
pub(super) const COMMANDS_MISSING: &str = "commands_missing";
/// The code: rows in which the rate of a rotor is not known.
pub(super) const ROTOR_RATE_MISSING: &str = "rotor_rate_missing";
/// The code: rows too few between two holes.
pub(super) const HOLES: &str = "holes";
/// The code: readings too few between whatever ends a run.
pub(super) const SHORT_RUN: &str = "short_run";

/// Ranges of rows, ascending, each with a code.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LeftOut(Vec<(Range<usize>, &'static str)>);

impl LeftOut {
    /// Of each row from 0 on why it is left out; `None` of one that is not.
    pub(crate) fn of(why: impl Iterator<Item = Option<&'static str>>) -> Self {
        let mut found: Vec<(Range<usize>, &'static str)> = Vec::new();
        for (row, code) in why.enumerate().filter_map(|(row, code)| Some((row, code?))) {
            match found.last_mut() {
                Some((rows, last)) if rows.end == row && *last == code => rows.end = row + 1,
                _ => found.push((row..row + 1, code)),
            }
        }
        Self(found)
    }

    /// Why a row is left out; `None` of one that is not.
    pub(crate) fn reason(&self, row: usize) -> Option<&'static str> {
        let at = self.0.partition_point(|(rows, _)| rows.end <= row);
        self.0.get(at).filter(|(rows, _)| rows.contains(&row)).map(|(_, code)| *code)
    }

    /// Those, and those of the log of which these are a part: `rows` are its own in it.
    pub(crate) fn and_of(&self, whole: &Self, rows: &[usize]) -> Self {
        let own = rows.iter().enumerate();
        Self::of(own.map(|(row, own)| whole.reason(*own).or_else(|| self.reason(row))))
    }

    /// A channel, not-a-number in the rows that are left out.
    pub(crate) fn blank<'a>(&self, values: &'a [f64]) -> Cow<'a, [f64]> {
        if self.0.is_empty() {
            return Cow::Borrowed(values);
        }
        let mut left = values.to_vec();
        self.0.iter().for_each(|(rows, _)| left[rows.clone()].fill(f64::NAN));
        Cow::Owned(left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_with_one_reason_are_one_range() {
        let why = [None, Some("a"), Some("a"), Some("b"), None];
        let left_out = LeftOut::of(why.into_iter());
        assert_eq!(left_out.0, [(1..3, "a"), (3..4, "b")]);
        assert_eq!([0, 1, 2, 3, 4, 9].map(|row| left_out.reason(row)), [why, [None; 5]].concat()[..6]);
        let blank = left_out.blank(&[1.0; 5]).into_owned();
        assert_eq!(blank.iter().map(|value| value.is_nan()).collect::<Vec<_>>(), why.map(|it| it.is_some()));
        assert!(matches!(LeftOut::default().blank(&[1.0]), Cow::Borrowed(_)));
    }
}
