//! Order statistics.

use super::finite::{finite, gathered};
use crate::cancel;

/// The median of the size of a normal variable, over its standard deviation.
pub const MEDIAN_OF_NORMAL: f64 = 0.674_489_75;

/// The value below which this `share` [-] of `values` lies, of those that are finite: 0 gives the least and 1 the greatest.
/// `None` of none.
#[must_use]
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    cancel::check();
    let mut values = finite(values);
    let last = values.len().checked_sub(1)?;
    let rank = (share * values.len() as f64) as usize;
    Some(*values.select_nth_unstable_by(rank.min(last), f64::total_cmp).1)
}

/// The same for several shares at once.
#[must_use]
pub fn quantiles<const N: usize>(
    values: impl IntoIterator<Item = f64>,
    shares: [f64; N],
) -> Option<[f64; N]> {
    cancel::check();
    let mut values = finite(values);
    let (count, last) = (values.len() as f64, values.len().checked_sub(1)?);
    Some(shares.map(|share| {
        let rank = (share * count) as usize;
        *values.select_nth_unstable_by(rank.min(last), f64::total_cmp).1
    }))
}

/// The values in ascending order.
#[must_use]
pub fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    cancel::check();
    let mut keys = gathered(values.into_iter().map(key));
    // Equal numbers are the same: their order does not show.
    keys.sort_unstable();
    keys.into_iter().map(of_key).collect()
}

/// A whole number that is less where the value is, by [`f64::total_cmp`]: whole numbers are sorted in half the time.
fn key(value: f64) -> i64 {
    let bits = value.to_bits() as i64;
    bits ^ (i64::MAX & (bits >> 63))
}

/// The value again: what the sign flips, it flips back.
fn of_key(key: i64) -> f64 {
    f64::from_bits((key ^ (i64::MAX & (key >> 63))) as u64)
}

/// The finite values in ascending order, each once.
#[must_use]
pub fn distinct(values: &[f64]) -> Vec<f64> {
    let mut values = sorted(values.iter().copied().filter(|value| value.is_finite()));
    values.dedup();
    values
}

/// Least and greatest of the values that are finite; infinite and the wrong way round of none.
#[must_use]
pub fn extremes(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// The value in the middle, of an even number the upper one; `None` of none.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// The median difference of neighbours, as of stamps [s] that is their usual interval [s]; `None` of fewer than two.
#[must_use]
pub fn median_step(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut last = None;
    median(values.into_iter().filter_map(|value| last.replace(value).map(|last: f64| value - last)))
}

/// The median as statistics has it: of an even number, the mean of the two in the middle. `None` of none.
#[must_use]
pub fn middle(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let values = sorted(values);
    let (upper, is_odd) = (values.len() / 2, values.len() % 2 == 1);
    let at = *values.get(upper)?;
    Some(if is_odd { at } else { 0.5 * (values[upper - 1] + at) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::is_left_within;

    #[test]
    fn what_looks_through_a_column_is_left_when_its_end_is_asked_for() {
        assert!(is_left_within(|| sorted([1.0])));
        assert!(is_left_within(|| quantile([1.0], 0.5)));
        assert!(is_left_within(|| quantiles([1.0], [0.5])));
    }

    #[test]
    fn ranks_count_what_is_finite() {
        let values = [3.0, f64::NAN, 1.0, 4.0, f64::INFINITY, 2.0];
        assert_eq!(
            [0.0, 0.25, 0.5, 1.0].map(|share| quantile(values, share)),
            [1.0, 2.0, 3.0, 4.0].map(Some)
        );
        assert_eq!(quantiles(values, [1.0, 0.0, 0.5]), Some([4.0, 1.0, 3.0]));
        assert_eq!(median([5.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([f64::NAN]), None);
        assert_eq!(distinct(&[3.0, f64::NAN, 1.0, 3.0]), [1.0, 3.0]);
        assert_eq!(sorted([2.0, f64::INFINITY, -1.0]), [-1.0, 2.0, f64::INFINITY]);
    }

    #[test]
    fn what_is_sorted_is_in_the_total_order_of_numbers() {
        let values = [
            1.5,
            f64::NAN,
            -f64::INFINITY,
            0.0,
            -1e-310,
            -0.0,
            -2.5,
            f64::INFINITY,
            5e-324,
            -f64::NAN,
            1e300,
            -2.0,
        ];
        let mut expected = values;
        expected.sort_by(f64::total_cmp);
        assert_eq!(
            sorted(values).iter().map(|it| it.to_bits()).collect::<Vec<_>>(),
            expected.map(f64::to_bits)
        );
    }

    #[test]
    fn the_usual_step_is_that_of_neighbours() {
        assert_eq!(median_step([0.0, 1.0, 3.0, 4.0, 14.0]), Some(2.0));
        assert_eq!((median_step([5.0]), median_step([])), (None, None));
    }

    #[test]
    fn the_middle_of_an_even_number_lies_between_two() {
        assert_eq!([middle([3.0, 1.0, 2.0]), middle([4.0, 1.0]), middle([])], [Some(2.0), Some(2.5), None]);
        assert_eq!(median([4.0, 1.0]), Some(4.0));
    }
}
