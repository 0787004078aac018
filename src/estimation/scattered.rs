//! Samples of a long record that are taken here and there: in step they might meet each turn of an experiment, or each reading of a slow
//! sensor, at the same moment, or never.

/// A number below 65,536 that follows no rule from one index to the next: Knuth's multiplicative hash.
#[must_use]
pub(crate) fn scattered(index: usize) -> usize {
    (index.wrapping_mul(2_654_435_761) >> 16) & 0xffff
}

/// One in `share` of so many samples, anywhere in its group; all where that is one.
pub(crate) fn one_in(share: usize, samples: usize) -> impl Iterator<Item = usize> {
    let within = move |group: usize| if share > 1 { scattered(group) % share } else { 0 };
    let taken = (0..samples.div_ceil(share.max(1))).map(move |group| group * share.max(1) + within(group));
    taken.filter(move |sample| *sample < samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_taken_of_each_group_and_not_in_step() {
        assert!(one_in(1, 9).eq(0..9) && one_in(4, 0).next().is_none());
        let taken: Vec<usize> = one_in(4, 40_000).collect();
        assert!(taken.iter().enumerate().all(|(group, sample)| sample / 4 == group));
        for place in 0..4 {
            let there = taken.iter().filter(|sample| *sample % 4 == place).count();
            // A quarter of 10,000, and what an honest die leaves.
            assert!((2_300..2_700).contains(&there), "{there}");
        }
    }
}
