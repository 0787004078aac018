//! The noise of each sensor, estimated from the data.

use std::collections::BTreeMap;

use super::block_run::BlockRun;
use super::channels::RATES;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::deviation;
use crate::estimation::noise_floor::{DITHERED, RESOLUTION};
use crate::estimation::quantile::{MEDIAN_OF_NORMAL, median};
use crate::estimation::quantization_step::quantization_step;
use crate::estimation::third_differences::THIRD_DIFFERENCE;
use crate::log::Dataset;
use crate::model::Model;

/// Standard deviation of the white noise of each measured signal, by column.
#[derive(Debug, Clone, Default)]
pub(crate) struct Noise(BTreeMap<String, f64>);

impl Noise {
    /// The smallest of what the signal itself shows and what each model leaves of it: a model that follows a
    /// fast signal uncovers the noise below it, and no model can make noise smaller.
    pub(crate) fn estimate(log: &Dataset, runs: &[Vec<BlockRun>]) -> Self {
        let mut sizes = BTreeMap::new();
        for name in log.names() {
            if let Some(values) = log.column(name) {
                let pieces = log.segments().into_iter().map(|rows| &values[rows]);
                sizes.insert(name.to_owned(), white_noise(pieces));
            }
        }
        for run in runs.iter().flatten().filter(|run| run.shows_noise) {
            let residual = run.residual();
            // Short windows, or few readings in each, leave no differences, or too few to tell anything.
            let there = |four: &&[f64]| four.iter().all(|value| value.is_finite());
            let known =
                run.pieces.iter().map(|piece| residual[piece.clone()].windows(4).filter(there).count());
            if run.is_in_windows() && known.sum::<usize>() < THRESHOLDS.noise_block {
                continue;
            }
            let left = white_noise(run.pieces.iter().map(|piece| &residual[piece.clone()]));
            if let Some(size) = sizes.get_mut(&run.signal) {
                // The smaller of two estimates of one noise would lie below both: only a clear fall counts.
                if left < THRESHOLDS.clearly_less_noise * *size {
                    *size = left;
                }
            }
        }
        // What no error can resolve, however quiet the sensor: data free of noise would never be explained.
        for (name, size) in &mut sizes {
            let values = log.column(name).unwrap_or(&[]);
            *size = size.max(RESOLUTION * deviation(values.iter().copied()));
            // Nor what a reading's steps take away, which does not change from sample to sample where the noise is smaller.
            let step = quantization_step(values.iter().copied());
            if *size < DITHERED * step {
                *size = size.hypot(step / 12.0_f64.sqrt());
            }
        }
        Self(sizes)
    }

    /// Of a column; zero when it is not there.
    pub(crate) fn of(&self, column: &str) -> f64 {
        self.0.get(column).copied().unwrap_or(0.0)
    }
}

/// [rad/s²] noise that the measured rates of both rotors put on the body's acceleration.
pub(crate) fn rotor_noise(model: &Model, noise: &Noise) -> f64 {
    let actuator = &model.actuator;
    let slope = 2.0 * model.body.arm * actuator.thrust_coefficient * actuator.hover_rate / model.body.inertia;
    slope * noise.of(RATES[0]).hypot(noise.of(RATES[1]))
}

/// Standard deviation of the part of a signal that no parabola through neighbouring samples explains, from
/// third differences over blocks: steps and spikes, being few, do not count, and neither do stretches that
/// move too fast.
pub(crate) fn white_noise<'a>(pieces: impl Iterator<Item = &'a [f64]>) -> f64 {
    let sizes = |piece: &[f64]| -> Vec<f64> {
        let differences = piece.windows(4).map(|w| (w[0] - 3.0 * w[1] + 3.0 * w[2] - w[3]).abs());
        differences.filter(|size| size.is_finite()).collect()
    };
    let pieces: Vec<&[f64]> = pieces.collect();
    let there = |piece: &&[f64]| piece.iter().filter(|value| value.is_finite()).count();
    let known: usize = pieces.iter().map(there).sum();
    let mut differences: Vec<f64> = pieces.iter().flat_map(|piece| sizes(piece)).collect();
    // A sensor slower than the rows hardly ever has four values in a row: then its own rows count.
    if THRESHOLDS.in_a_row * differences.len() < known {
        let own = pieces
            .iter()
            .map(|piece| -> Vec<f64> { piece.iter().copied().filter(|value| value.is_finite()).collect() });
        differences = own.flat_map(|own| sizes(&own)).collect();
    }
    let blocks = (differences.len() / THRESHOLDS.noise_block).max(1);
    let mut estimates: Vec<f64> =
        differences.chunks(differences.len().div_ceil(blocks).max(1)).map(of_block).collect();
    estimates.sort_by(f64::total_cmp);
    let Some(ranked) = estimates.get((THRESHOLDS.noise_rank * estimates.len() as f64) as usize) else {
        return 0.0;
    };
    let alike: Vec<f64> =
        estimates.iter().copied().take_while(|size| *size <= THRESHOLDS.noise_scatter * ranked).collect();
    (alike.iter().map(|size| size * size).sum::<f64>() / alike.len() as f64).sqrt()
}

/// Rms without what the median calls outliers.
fn of_block(differences: &[f64]) -> f64 {
    let median = median(differences.iter().copied()).unwrap_or(0.0);
    // On a coarse grid most neighbours are equal: then every flip between steps counts.
    let limit =
        if median > 0.0 { THRESHOLDS.outlier_differences * median / MEDIAN_OF_NORMAL } else { f64::INFINITY };
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
        let found = white_noise(std::iter::once(signal.as_slice()));
        // 6,000 correlated differences know it to about 1.5 %; steps and the choice of blocks add a little.
        assert!((found / 1.5 - 1.0).abs() < 0.05, "{found}");
    }

    #[test]
    fn noise_of_a_sensor_slower_than_the_rows_is_found() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let normal = Normal::new(0.0, 1.5).unwrap();
        let each = (0..12_000).map(|k| if k % 3 == 0 { normal.sample(&mut rng) } else { f64::NAN });
        let signal: Vec<f64> = each.collect();
        let found = white_noise(std::iter::once(signal.as_slice()));
        // 4,000 of them know it to about 2 %.
        assert!((found / 1.5 - 1.0).abs() < 0.06, "{found}");
    }

    /// A gyro at 50 Hz on a body that swings three times a second: its own differences show the swing. Windows of a model that
    /// follows it, each begun at a noisy sample, do not.
    #[test]
    fn windows_show_the_noise_below_a_fast_signal() {
        use super::super::block_run::NoisePath;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(6);
        let normal = Normal::new(0.0, 0.004).unwrap();
        let time: Vec<f64> = (0..6_000).map(|k| 0.02 * f64::from(k)).collect();
        let swing: Vec<f64> = time.iter().map(|t| (6.0 * std::f64::consts::PI * t).sin()).collect();
        let rate: Vec<f64> = swing.iter().map(|rate| rate + normal.sample(&mut rng)).collect();
        let mut log = Dataset::new("here", "", time).unwrap();
        log.insert("body_rate_rad_s", rate.clone()).unwrap();
        let floor = NoisePath::Window { rotors: false, angle: false };
        let mut run = BlockRun::new("body", "body_rate_rad_s", "rad/s", &[], floor);
        for start in (0..5_985).step_by(15) {
            let rows = start + 1..start + 16;
            let begun = rate[start] - swing[start];
            let modelled: Vec<f64> = swing[rows.clone()].iter().map(|rate| rate + begun).collect();
            run.add(rows.clone(), &rate[rows], &modelled);
        }
        // Three readings in each window: they tell nothing.
        let mut sparse = BlockRun::new("body", "body_rate_rad_s", "rad/s", &[], floor);
        for start in (0..5_985).step_by(15) {
            let rows = start + 1..start + 16;
            let seldom = |row: usize| if row.is_multiple_of(5) { rate[row] } else { f64::NAN };
            sparse.add(rows.clone(), &rows.clone().map(seldom).collect::<Vec<f64>>(), &swing[rows]);
        }
        let alone = Noise::estimate(&log, &[]).of("body_rate_rad_s");
        let of_few = Noise::estimate(&log, &[vec![sparse]]).of("body_rate_rad_s");
        let found = Noise::estimate(&log, &[vec![run]]).of("body_rate_rad_s");
        assert_eq!(of_few, alone);
        assert!(alone > 0.008, "{alone}");
        // 4,800 correlated differences know it to about 1.7 %.
        assert!((found / 0.004 - 1.0).abs() < 0.06, "{found}");
    }

    #[test]
    fn nothing_measured_has_no_noise() {
        assert_eq!(white_noise(std::iter::empty()), 0.0);
        assert_eq!(white_noise(std::iter::once([f64::NAN; 9].as_slice())), 0.0);
        assert_eq!(white_noise(std::iter::once([1.0; 3].as_slice())), 0.0);
    }
}
