//! What a command comes in, and which voltages are commands: by the values.

use super::words::Words;
use crate::estimation::quantile::{extremes, quantiles};
use crate::log::sniff::SampledColumn;
use crate::log::thresholds::THRESHOLDS;
use crate::signal::columns;

/// Unit, factor and offset of a command, and whether its name says the unit; `same_kind` are the columns of the same name for all rotors, that come in one unit.
pub(super) fn comes_in(
    words: &Words,
    same_kind: &[&SampledColumn],
) -> Option<(&'static str, f64, f64, bool)> {
    let values = || same_kind.iter().flat_map(|column| column.values.iter().copied());
    let (low, high) = extremes(values());
    let pulse = ("-", 1e-3, -1.0);
    let dshot = ("-", 1.0 / 1999.0, -48.0 / 1999.0);
    let by_unit = |(unit, scale, offset)| Some((unit, scale, offset, true));
    match words.unit {
        Some("µs" | "us") => return by_unit(pulse),
        Some("ms") => return by_unit(("-", 1.0, -1.0)),
        Some("%") => return by_unit(("%", 1.0, 0.0)),
        _ if words.has("dshot") => return by_unit(dshot),
        _ => {}
    }
    let (shortest, longest) = THRESHOLDS.guess_pulse;
    let is_whole = values().all(|value| value.is_nan() || value.fract() == 0.0);
    let (unit, scale, offset) = match (low, high) {
        (0.0.., ..=1.0) => ("-", 1.0, 0.0),
        (0.0.., ..=100.0) => ("%", 1.0, 0.0),
        (low, high) if low >= shortest && high <= longest => pulse,
        // Motors that idle by DShot, whose throttle begins at 48.
        (48.0.., ..255.0) if words.has("motor") => dshot,
        (0.0.., ..=255.0) if is_whole => ("-", 1.0 / 255.0, 0.0),
        (0.0.., ..=2047.0) => dshot,
        _ => return None,
    };
    Some((unit, scale, offset, false))
}

/// The greatest size of a voltage that moves as what is asked for does: it goes to 0, or it is held in steps; `None` of any other.
pub(super) fn asked_voltage(signal: &str, column: &SampledColumn) -> Option<AskedVoltage> {
    if signal != columns::BATTERY_VOLTAGE {
        return None;
    }
    let values = || column.values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = extremes(values());
    let greatest = low.abs().max(high.abs());
    let count = values().count() as f64;
    let small = values().filter(|value| value.abs() <= THRESHOLDS.guess_no_volts * greatest).count() as f64;
    let goes_to_zero = greatest > 0.0 && small >= THRESHOLDS.guess_dead_rows * count && small < count;
    let pairs = || values().zip(values().skip(1));
    let held = pairs().filter(|(before, now)| before == now).count() as f64;
    let steps = pairs().count() as f64 - held;
    let is_held = steps >= THRESHOLDS.guess_volt_steps && held >= THRESHOLDS.guess_held_rows * count;
    // Single dropouts make no range.
    let ends = quantiles(values(), [THRESHOLDS.guess_dead_rows, 1.0 - THRESHOLDS.guess_dead_rows]);
    let is_wide = ends.is_some_and(|[low, high]| high - low >= THRESHOLDS.guess_volt_range * greatest);
    (goes_to_zero || is_held && is_wide).then_some(AskedVoltage { greatest, goes_to_zero })
}

/// A voltage that moves as what is asked for does.
pub(super) struct AskedVoltage {
    /// The greatest size.
    pub greatest: f64,
    /// Whether it goes to 0, as no battery does that turns a motor.
    pub goes_to_zero: bool,
}
