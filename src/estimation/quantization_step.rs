//! The quantization step of a reading.

/// Share of the range below which two readings are one, and of a step by which one may lie beside the grid: decimals.
const SAME: f64 = 1e-7;
const OFF_GRID: f64 = 0.05;
/// Share of the gaps between readings that must be whole steps, and the fewest gaps that show a grid.
const ON_GRID: f64 = 0.95;
const FEWEST_GAPS: usize = 5;

/// The step in which readings are quantized, in their unit: all of them lie on a grid of it; 0 where they do not.
#[must_use]
pub fn quantization_step(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_unstable_by(f64::total_cmp);
    let of_range = values.last().zip(values.first()).map_or(0.0, |(last, first)| SAME * (last - first));
    let gaps = || values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > of_range);
    let step = gaps().fold(f64::INFINITY, f64::min);
    let is_whole = |gap: &f64| (gap / step - (gap / step).round()).abs() < OFF_GRID;
    let (whole, all) = (gaps().filter(is_whole).count(), gaps().count());
    if all >= FEWEST_GAPS && whole as f64 > ON_GRID * all as f64 { step } else { 0.0 }
}
