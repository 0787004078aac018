//! Piecewise linear functions: hats over evenly spaced knots.

/// The two hats that are not zero at `place`, counted in intervals from the first knot, of `intervals` of them: which, and how
/// high each is there.
pub(crate) fn hats(place: f64, intervals: usize) -> [(usize, f64); 2] {
    let left = (place.floor() as usize).min(intervals - 1);
    let right = place - left as f64;
    [(left, 1.0 - right), (left + 1, right)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_lies_under_two_hats_that_add_up_to_one() {
        assert_eq!(hats(0.0, 3), [(0, 1.0), (1, 0.0)]);
        assert_eq!(hats(1.25, 3), [(1, 0.75), (2, 0.25)]);
        assert_eq!(hats(3.0, 3), [(2, 0.0), (3, 1.0)]);
    }
}
