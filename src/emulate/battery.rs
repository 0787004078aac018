//! A battery that empties under load.

use serde::{Deserialize, Serialize};

use super::error::EmulateError;

/// The `[emulator.battery]` table.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BatteryConfig {
    /// [A h] charge when full.
    pub capacity_ah: f64,
    /// [V] open-circuit voltage when empty; the full one is the plant's `full_voltage`.
    pub empty_voltage: f64,
    /// [-] share of the charge already used at the start, 0..1.
    pub used: f64,
    /// [ohm] internal resistance: the voltage gives way under load at once.
    pub internal_resistance: f64,
    /// [A] of the electronics, with the rotors standing.
    pub idle_current: f64,
    /// [A] of one rotor at hover; grows with the third power of its rate.
    pub hover_current: f64,
}

impl Default for BatteryConfig {
    /// Three lithium cells, 5 A h: 40 minutes of one rotor at hover, as long as the paper's PRBS.
    fn default() -> Self {
        Self {
            capacity_ah: 5.0,
            empty_voltage: 10.4,
            used: 0.0,
            internal_resistance: 0.012,
            idle_current: 0.2,
            hover_current: 4.5,
        }
    }
}

impl BatteryConfig {
    pub(super) fn check(&self, full_voltage: f64) -> Result<(), EmulateError> {
        let ranges = [
            ("battery.capacity_ah", self.capacity_ah, 1e-3, 1e9),
            ("battery.empty_voltage", self.empty_voltage, 0.0, full_voltage),
            ("battery.used", self.used, 0.0, 1.0),
            ("battery.internal_resistance", self.internal_resistance, 0.0, 10.0),
            ("battery.idle_current", self.idle_current, 0.0, 1e3),
            ("battery.hover_current", self.hover_current, 0.0, 1e3),
        ];
        for (name, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err(EmulateError::Range { name, value, low, high });
            }
        }
        Ok(())
    }

    /// [V] at the terminals, with the share `used` of the charge gone and `current` flowing.
    pub(super) fn voltage(&self, full_voltage: f64, used: f64, current: f64) -> f64 {
        let used = used.clamp(0.0, 1.0);
        // Nearly straight, with the knee of an emptying cell at the end.
        let square = used * used;
        let knee = square * square * square * square;
        let open_circuit = full_voltage - (full_voltage - self.empty_voltage) * (0.7 * used + 0.3 * knee);
        (open_circuit - self.internal_resistance * current).max(0.0)
    }

    /// [A] that a rotor draws, at `ratio` of its hover rate.
    pub(super) fn rotor_current(&self, ratio: f64) -> f64 {
        self.hover_current * ratio * ratio * ratio.abs()
    }

    /// [1/s] Share of the charge that leaves each second.
    pub(super) fn drain(&self, current: f64) -> f64 {
        current / (3600.0 * self.capacity_ah)
    }
}
