//! Readings of a battery that no battery has which turns rotors: zeros of a telemetry that dropped out, or its greatest number.

use serde::Serialize;

use super::readings::told;
use crate::estimation::quantile::median;

/// The channel that is looked at.
pub const BATTERY: &str = "battery_voltage_v";
/// [V] no battery that turns a rotor has less.
pub const EMPTY: f64 = 2.0;
/// Times the middle reading from which one is none.
const OVERFULL: f64 = 3.0;

/// Readings below [`EMPTY`], or far above all others, beside more that are neither.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Empty {
    /// Their rows, from 0.
    #[serde(skip)]
    pub rows: Vec<usize>,
    /// How many they are.
    pub cells: usize,
    /// [V] the middle one of all.
    pub middle_v: f64,
}

impl Empty {
    /// In words.
    pub(crate) fn sentence(&self, name: &str) -> String {
        format!(
            "`{name}`: {} readings below {EMPTY} V or over {OVERFULL} times the middle one ({} V), which no battery has that turns \
             a rotor: they count as missing",
            self.cells,
            told(self.middle_v, 4)
        )
    }
}

/// Looks for them in `volts`; `None` too where most readings are such.
pub(crate) fn find(volts: &[f64]) -> Option<Empty> {
    let middle_v = median(volts.iter().copied())?;
    let is_none = |row: &usize| volts[*row] < EMPTY || volts[*row] > OVERFULL * middle_v;
    let rows: Vec<usize> = (0..volts.len()).filter(is_none).collect();
    (!rows.is_empty() && middle_v >= EMPTY).then_some(Empty { cells: rows.len(), rows, middle_v })
}
