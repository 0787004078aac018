//! The block bootstrap: what is drawn by lot are stretches, within which residuals may be correlated (Kuensch 1989).

use rand::{RngExt, SeedableRng};

use super::consistency::power;

/// How often `own` residuals are smaller than each of `others`, in rms over `stretches` of them that are drawn by lot, each as often as it
/// comes, in so many `draws`; 0 of none.
#[must_use]
pub(crate) fn share_of_wins(own: &[f64], others: &[&[f64]], stretches: usize, draws: usize) -> f64 {
    let powers = |residuals: &[f64]| -> Vec<f64> {
        residuals.chunks(residuals.len().div_ceil(stretches).max(1)).map(power).collect()
    };
    let own = powers(own);
    let others: Vec<Vec<f64>> = others.iter().map(|of| powers(of)).collect();
    if own.is_empty() {
        return 0.0;
    }
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut wins = 0;
    for _ in 0..draws {
        let drawn: Vec<usize> = own.iter().map(|_| random.random_range(0..own.len())).collect();
        let sum = |of: &[f64]| drawn.iter().filter_map(|index| of.get(*index)).sum::<f64>();
        let mine = sum(&own);
        wins += usize::from(others.iter().all(|other| sum(other) > mine));
    }
    wins as f64 / draws as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_sure_where_each_stretch_says_so_and_even_where_none_does() {
        let confidence = |own: &[f64], other: &[f64]| share_of_wins(own, &[other], 40, 400);
        let own = vec![1.0; 400];
        assert_eq!(confidence(&own, &[1.1; 400]), 1.0);
        assert_eq!(confidence(&[1.1; 400], &own), 0.0);
        // Half of the stretches each way.
        let (mut one, mut other) = (own.clone(), own);
        (0..400).for_each(|row| if row / 10 % 2 == 0 { one[row] = 1.2 } else { other[row] = 1.2 });
        let even = confidence(&one, &other);
        assert!((0.3..0.7).contains(&even), "{even}");
    }
}
