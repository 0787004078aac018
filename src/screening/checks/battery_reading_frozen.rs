//! A battery whose reading keeps one value for longer than one that is read in steps does.

use crate::estimation::finite::finite_rows;
use crate::screening::battery_plateaus::longest_plateau;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// The longest time over which the voltage of a rotor keeps its value, where that is too long. It is said, and the reading is kept. One
/// that never moves is constant, which is said where it counts.
pub(crate) fn check(rotor: &RotorLog) -> Option<Suspicion> {
    let voltage = rotor.voltage.as_deref()?;
    let (low, high) = bounds(voltage);
    let (from, to, volts) = standing(&rotor.time, voltage)?;
    // Where it was not read it is held: that is `battery_reading_gap`.
    let is_held = rotor.voltage_gap.is_some_and(|gap| from >= gap.0 && to <= gap.1);
    let longest = THRESHOLDS.battery_frozen.max(longest_plateau(&rotor.time, voltage));
    let finding = rotor.finding("battery_reading_frozen").with("voltage_v", volts);
    (low < high && !is_held && to - from > longest)
        .then(|| Suspicion::said(finding.with("from_s", from).with("to_s", to)))
}

/// [s] [s] [V] the longest time over which a voltage keeps its value.
fn standing(time: &[f64], voltage: &[f64]) -> Option<(f64, f64, f64)> {
    let rows: Vec<usize> = finite_rows(voltage, 0..voltage.len());
    let spans = rows.chunk_by(|a, b| voltage[*a] == voltage[*b]).map(|run| {
        let (first, last) = (run[0], run[run.len() - 1]);
        (time[first], time[last], voltage[first])
    });
    spans.max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)))
}
