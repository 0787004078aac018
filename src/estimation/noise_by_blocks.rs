//! The white noise of a signal that also steps and moves fast: estimated block by block, the quiet blocks together.

use super::quantile::{MEDIAN_OF_NORMAL, median, sorted};
use super::third_differences::{THIRD_DIFFERENCE, third_differences};

/// How a signal is cut into blocks, and which of them count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseBlocks {
    /// Samples of one block.
    pub samples: usize,
    /// [-] rank among the estimates of the blocks that stands for the noise.
    pub rank: f64,
    /// [-] blocks up to this many times the ranked one count as noise.
    pub scatter: f64,
    /// Standard deviations beyond which differences are steps and spikes.
    pub outliers: f64,
}

/// Standard deviation of the part of a signal that no parabola through neighbouring samples explains, from
/// third differences over blocks: steps and spikes, being few, do not count, and neither do stretches that
/// move too fast.
#[must_use]
pub fn noise_by_blocks<'a>(pieces: impl Iterator<Item = &'a [f64]> + Clone, config: &NoiseBlocks) -> f64 {
    let differences = third_differences(pieces, |value| value.is_finite(), 1);
    let blocks = (differences.len() / config.samples).max(1);
    let blocks = differences.chunks(differences.len().div_ceil(blocks).max(1));
    let estimates = sorted(blocks.map(|block| of_block(block, config)));
    let Some(ranked) = estimates.get((config.rank * estimates.len() as f64) as usize) else {
        return 0.0;
    };
    let of_noise: Vec<f64> =
        estimates.iter().copied().take_while(|size| *size <= config.scatter * ranked).collect();
    (of_noise.iter().map(|size| size * size).sum::<f64>() / of_noise.len() as f64).sqrt()
}

/// Rms without what the median calls outliers.
fn of_block(differences: &[f64], config: &NoiseBlocks) -> f64 {
    let median = median(differences.iter().copied()).unwrap_or(0.0);
    // On a coarse grid most neighbours are equal: then every flip between steps counts.
    let limit = if median > 0.0 { config.outliers * median / MEDIAN_OF_NORMAL } else { f64::INFINITY };
    let (sum, count) = differences
        .iter()
        .filter(|size| **size <= limit)
        .fold((0.0, 0.0), |(sum, count), size| (sum + size * size, count + 1.0));
    f64::sqrt(sum / count / THIRD_DIFFERENCE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    const CONFIG: NoiseBlocks = NoiseBlocks { samples: 200, rank: 0.4, scatter: 1.15, outliers: 3.5 };

    #[test]
    fn white_noise_is_found_below_a_smooth_signal_with_steps() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let normal = Normal::new(0.0, 1.5).unwrap();
        let signal: Vec<f64> = (0..6_000)
            .map(|k| {
                let t = 0.02 * f64::from(k);
                600.0 + 100.0 * t.sin() + if k % 100 < 50 { 80.0 } else { 0.0 } + normal.sample(&mut rng)
            })
            .collect();
        let found = noise_by_blocks(std::iter::once(signal.as_slice()), &CONFIG);
        // 6,000 correlated differences know it to about 1.5 %; steps and the choice of blocks add a little.
        assert!((found / 1.5 - 1.0).abs() < 0.05, "{found}");
    }

    #[test]
    fn noise_of_a_sensor_slower_than_the_rows_is_found() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let normal = Normal::new(0.0, 1.5).unwrap();
        let each = (0..12_000).map(|k| if k % 3 == 0 { normal.sample(&mut rng) } else { f64::NAN });
        let signal: Vec<f64> = each.collect();
        let found = noise_by_blocks(std::iter::once(signal.as_slice()), &CONFIG);
        // 4,000 of them know it to about 2 %.
        assert!((found / 1.5 - 1.0).abs() < 0.06, "{found}");
    }

    #[test]
    fn nothing_measured_has_no_noise() {
        assert_eq!(noise_by_blocks(std::iter::empty(), &CONFIG), 0.0);
        assert_eq!(noise_by_blocks(std::iter::once([f64::NAN; 9].as_slice()), &CONFIG), 0.0);
        assert_eq!(noise_by_blocks(std::iter::once([1.0; 3].as_slice()), &CONFIG), 0.0);
    }
}
