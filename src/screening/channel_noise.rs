//! The noise of a channel of a log: the one place where every room takes it from.

use std::ops::Range;

use super::thresholds::THRESHOLDS;
use crate::estimation::moments::deviation;
use crate::estimation::noise_by_blocks::{NoiseBlocks, noise_by_blocks};
use crate::estimation::noise_floor::{Left, SensorNoise, noise_left, white_left, with_steps};
use crate::estimation::quantization_step::quantization_step;

const BLOCKS: NoiseBlocks = NoiseBlocks {
    samples: THRESHOLDS.noise_block,
    rank: THRESHOLDS.noise_rank,
    scatter: THRESHOLDS.noise_scatter,
    outliers: THRESHOLDS.outlier_differences,
};

/// What the readings of a channel say of its noise, before any model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ChannelNoise {
    /// In the channel's unit: the step in which it is read; 0 where there is none.
    pub step: f64,
    /// In the channel's unit: below this no error says anything, however quiet the sensor is. Data free of noise would never be
    /// explained.
    pub resolution: f64,
}

impl ChannelNoise {
    /// Of its readings, in any order; what is not a number is missing.
    #[must_use]
    pub fn of(readings: impl Iterator<Item = f64> + Clone) -> Self {
        Self {
            step: quantization_step(readings.clone()),
            resolution: THRESHOLDS.resolution * deviation(readings),
        }
    }

    /// Rms of the noise, in the channel's unit, as the channel itself shows it, which moves: in its quiet stretches.
    #[must_use]
    pub fn in_signal(&self, values: &[f64], segments: &[Range<usize>]) -> f64 {
        let white = noise_by_blocks(segments.iter().map(|rows| &values[rows.clone()]), &BLOCKS);
        with_steps(white, white, self.step).max(self.resolution)
    }

    /// The noise in what a model leaves of the channel, in the channel's unit. `residual` is over `unit`, and zero or not a number where
    /// nothing was measured, and `modelled` is asked of rows in which something was; `propagated` is the rms of what noise of other sensors leaves in it, in the channel's unit.
    #[must_use]
    pub fn in_residual(
        &self,
        (residual, modelled): (&[f64], &dyn Fn(usize) -> f64),
        pieces: &[Range<usize>],
        propagated: f64,
        unit: f64,
    ) -> SensorNoise {
        let (step, propagated) = (self.step / unit, propagated / unit);
        let found = noise_left(&Left { residual, modelled, pieces, step, propagated });
        SensorNoise { rms: (unit * found.rms).max(self.resolution), ..found }
    }

    /// Rms of what surely is noise in a residual over `unit`, in the channel's unit.
    #[must_use]
    pub fn white_in_residual(&self, residual: &[f64], pieces: &[Range<usize>], unit: f64) -> f64 {
        (unit * white_left(residual, pieces, self.step / unit)).max(self.resolution)
    }
}
