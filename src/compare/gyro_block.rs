//! The gyroscope against the angle: two sensors of one motion.
//!
//! The angle's slope over a short window is the true rate, smoothed; the model's gyroscope turns it into a
//! reading. The measured reading is smoothed by the same weights: integrated, then its slope taken alike.

use super::block_run::{BlockRun, NoisePath};
use super::thresholds::THRESHOLDS;
use crate::estimation::integral::running;
use crate::estimation::slope::{centred_slope_noise, centred_slopes};
use crate::log::Dataset;
use crate::log::segments::stretches;
use crate::model::Equations;
use crate::screening::readings;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// Runs the block; `None` where one of the two sensors is missing.
pub(crate) fn run(equations: &Equations, log: &Dataset) -> Option<BlockRun> {
    let lines = |name: &str| log.column(name).map(|values| readings::bridged(log.time(), values));
    let (rate, angle) = (lines(BODY_RATE)?, lines(BODY_ANGLE)?);
    let (least, most) = THRESHOLDS.slope_reach;
    let half = ((THRESHOLDS.slope_reach_s / log.median_interval()).round() as usize).clamp(least, most);
    let mut block = BlockRun::new("sensors", BODY_RATE, "rad/s", &[BODY_ANGLE], NoisePath::Slope(half));
    for stretch in stretches(log, &[&rate, &angle]) {
        let [rate, angle] = &stretch.inputs[..] else { continue };
        let time = &log.time()[stretch.rows.clone()];
        if time.len() < THRESHOLDS.slope_stretch * half {
            continue;
        }
        let [turned, measured] = centred_slopes(time, [angle, &integral(time, rate)], half);
        let modelled = equations.gyroscope(time, &turned, angle);
        // Windows at the ends are lopsided and noisier.
        let kept = half..time.len() - half;
        let rows = stretch.rows.start + kept.start..stretch.rows.start + kept.end;
        block.add_own(rows, &measured[kept.clone()], &modelled[kept]);
    }
    (!block.rows.is_empty()).then_some(block)
}

/// The integral from the first sample on. A body that is quick beside the rows bends between them: where rows are even, a
/// cubic through four of them.
fn integral(time: &[f64], values: &[f64]) -> Vec<f64> {
    running(time, |row, step| {
        let is_even = |other: f64| (other / step - 1.0).abs() < THRESHOLDS.even_rows;
        let has_neighbours = row >= 1 && row + 2 < values.len();
        let mean = 0.5 * (values[row] + values[row + 1]);
        if has_neighbours && is_even(time[row] - time[row - 1]) && is_even(time[row + 2] - time[row + 1]) {
            step * (mean + (values[row] + values[row + 1] - values[row - 1] - values[row + 2]) / 24.0)
        } else {
            step * mean
        }
    })
}

/// [rad/s] what noise of gyroscope [rad/s] and angle [rad] leaves after the slopes.
pub(crate) fn noise(half: usize, interval: f64, gyro: f64, angle: f64) -> f64 {
    // The weights on the rate are a parabola over the window, whose squares integrate to 3 / (5 reach).
    let smoothed = gyro * (0.6 / half as f64).sqrt();
    (angle * centred_slope_noise(half, interval)).hypot(smoothed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight lines between the rows would cut 0.3 % off this motion: 3.3e-4 rad.
    #[test]
    fn a_quick_body_is_integrated_between_its_rows() {
        let time: Vec<f64> = (0..500).map(|row| 0.02 * f64::from(row)).collect();
        let rate: Vec<f64> = time.iter().map(|t| (10.0 * t).cos()).collect();
        let off = |(t, angle): (&f64, f64)| (angle - 0.1 * (10.0 * t).sin()).abs();
        let worst = time.iter().zip(integral(&time, &rate)).map(off).fold(0.0, f64::max);
        // Both ends are straight lines: 7e-5 rad each.
        assert!(worst < 1.5e-4, "{worst}");
    }
}
