//! What of a channel is there: its finite values, and their rows.

use std::ops::Range;

/// The values that are finite.
pub(crate) fn finite(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    gathered(values.into_iter().filter(|value| value.is_finite()))
}

/// Those of these rows in which a value is finite.
pub(crate) fn finite_rows(values: &[f64], rows: Range<usize>) -> Vec<usize> {
    gathered(rows.filter(|row| values.get(*row).is_some_and(|value| value.is_finite())))
}

/// All of them, with room from the beginning for as many as there can be: what grows is laid out and cleared anew each time that it is
/// twice as long. Where few are there, what is left of the room is given back.
pub(super) fn gathered<T>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    // Where so much is not to be had, it grows as it must.
    let _ = all.try_reserve_exact(items.size_hint().1.unwrap_or(0));
    all.extend(items);
    if 2 * all.len() < all.capacity() {
        all.shrink_to_fit();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_finite_is_there() {
        let values = [1.0, f64::NAN, f64::INFINITY, 4.0];
        assert_eq!(finite(values), [1.0, 4.0]);
        assert_eq!(finite_rows(&values, 1..9), [3]);
        assert_eq!(gathered((0..usize::MAX).take_while(|number| *number < 3)), [0, 1, 2]);
    }
}
