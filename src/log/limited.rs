//! A value within the ranges of its mapping.

use super::import_notes::Notes;
use super::mapping::SignalMapping;
use super::thresholds::THRESHOLDS;
use crate::signal::columns;

/// The value within the mapping's ranges.
pub(super) fn limited(notes: &mut Notes, signal: &SignalMapping, value: f64, line: u64) -> f64 {
    if signal.valid.is_some_and(|[low, high]| value < low || value > high) {
        notes.invalid.entry(signal.name.clone()).or_default().add(line);
        return f64::NAN;
    }
    match signal.clamp {
        Some([low, high]) if value < low || value > high => {
            notes.clamped.entry(signal.name.clone()).or_default().add(line);
            value.clamp(low, high)
        }
        _ if columns::is_command(&signal.name) => without_rounding(value),
        _ => value,
    }
}

/// [-] A command without what the digits of its scale and offset put it beyond nothing or all.
fn without_rounding(command: f64) -> f64 {
    let within = command.clamp(0.0, 1.0);
    if (command - within).abs() <= THRESHOLDS.command_rounding { within } else { command }
}
