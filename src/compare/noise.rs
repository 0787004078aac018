//! The noise of each sensor, estimated from the data.

use std::collections::BTreeMap;

use super::block_run::BlockRun;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::deviation;
use crate::estimation::noise_by_blocks::{NoiseBlocks, noise_by_blocks};
use crate::estimation::noise_floor::{DITHERED, RESOLUTION};
use crate::estimation::quantization_step::quantization_step;
use crate::log::Dataset;
use crate::model::Model;
use crate::signal::columns::PROPELLER_RATES;
use crate::threads::spread;

const BLOCKS: NoiseBlocks = NoiseBlocks {
    samples: THRESHOLDS.noise_block,
    rank: THRESHOLDS.noise_rank,
    scatter: THRESHOLDS.noise_scatter,
    outliers: THRESHOLDS.outlier_differences,
};

/// Standard deviation of the white noise of each measured signal, by column.
#[derive(Debug, Clone, Default)]
pub(crate) struct Noise(BTreeMap<String, f64>);

impl Noise {
    /// The smallest of what the signal itself shows and what each model leaves of it: a model that follows a
    /// fast signal uncovers the noise below it, and no model can make noise smaller.
    pub(crate) fn estimate(log: &Dataset, runs: &[Vec<BlockRun>]) -> Self {
        let segments = log.segments();
        let columns: Vec<(&str, &[f64])> =
            log.names().filter_map(|name| Some((name, log.column(name)?))).collect();
        let of_column = |(name, values): &(&str, &[f64])| {
            let size = noise_by_blocks(segments.iter().map(|rows| &values[rows.clone()]), &BLOCKS);
            ((*name).to_owned(), size)
        };
        let mut sizes: BTreeMap<String, f64> = spread(&columns, of_column).into_iter().collect();
        let shows_noise: Vec<&BlockRun> = runs.iter().flatten().filter(|run| run.shows_noise).collect();
        let left = spread(&shows_noise, |run| {
            let residual = run.residual(log);
            // Short windows, or few readings in each, leave no differences, or too few to tell anything.
            let there = |four: &&[f64]| four.iter().all(|value| value.is_finite());
            let known =
                run.pieces.iter().map(|piece| residual[piece.clone()].windows(4).filter(there).count());
            if run.is_in_windows() && known.sum::<usize>() < BLOCKS.samples {
                return f64::INFINITY;
            }
            noise_by_blocks(run.pieces.iter().map(|piece| &residual[piece.clone()]), &BLOCKS)
        });
        for (run, left) in shows_noise.iter().zip(left) {
            if let Some(size) = sizes.get_mut(&run.signal) {
                // The smaller of two estimates of one noise would lie below both: only a clear fall counts.
                if left < THRESHOLDS.clearly_less_noise * *size {
                    *size = left;
                }
            }
        }
        // What no error can resolve, however quiet the sensor: data free of noise would never be explained.
        let resolved = spread(&columns, |(name, values)| {
            let size = sizes.get(*name).copied().unwrap_or(0.0);
            let size = size.max(RESOLUTION * deviation(values.iter().copied()));
            // Nor what a reading's steps take away, which does not change from sample to sample where the noise is smaller.
            let step = quantization_step(values.iter().copied());
            (
                (*name).to_owned(),
                if size < DITHERED * step { size.hypot(step / 12.0_f64.sqrt()) } else { size },
            )
        });
        sizes = resolved.into_iter().collect();
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
    slope * noise.of(PROPELLER_RATES[0]).hypot(noise.of(PROPELLER_RATES[1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

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
            run.add(rows, &modelled);
        }
        // Three readings in each window: they tell nothing.
        let mut sparse = BlockRun::new("body", "body_rate_rad_s", "rad/s", &[], floor);
        for start in (0..5_985).step_by(15) {
            let rows = start + 1..start + 16;
            let seldom = |row: usize| if row.is_multiple_of(5) { rate[row] } else { f64::NAN };
            let measured: Vec<f64> = rows.clone().map(seldom).collect();
            sparse.add_scored(rows.clone(), &measured, &swing[rows]);
        }
        let alone = Noise::estimate(&log, &[]).of("body_rate_rad_s");
        let of_few = Noise::estimate(&log, &[vec![sparse]]).of("body_rate_rad_s");
        let found = Noise::estimate(&log, &[vec![run]]).of("body_rate_rad_s");
        assert_eq!(of_few, alone);
        assert!(alone > 0.008, "{alone}");
        // 4,800 correlated differences know it to about 1.7 %.
        assert!((found / 0.004 - 1.0).abs() < 0.06, "{found}");
    }
}
