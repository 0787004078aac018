//! The quantization step of a reading.

use super::quantile::sorted;
use super::thresholds::THRESHOLDS;

/// The step in which readings are quantized, in their unit: all of them lie on a grid of it; 0 where they do not.
#[must_use]
pub fn quantization_step(values: impl Iterator<Item = f64>) -> f64 {
    let values = sorted(values.filter(|value| value.is_finite()));
    let of_range = values
        .last()
        .zip(values.first())
        .map_or(0.0, |(last, first)| THRESHOLDS.same_reading * (last - first));
    let gaps = || values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > of_range);
    let step = gaps().fold(f64::INFINITY, f64::min);
    let is_whole = |gap: &f64| (gap / step - (gap / step).round()).abs() < THRESHOLDS.off_grid;
    let (whole, all) = (gaps().filter(is_whole).count(), gaps().count());
    if all >= THRESHOLDS.fewest_gaps && whole as f64 > THRESHOLDS.on_grid * all as f64 { step } else { 0.0 }
}
