//! Settings of the check of the rotors' speeds.

use serde::{Deserialize, Serialize};

use super::thresholds::THRESHOLDS;

/// The `[guard.speed_check]` table: whether each rotor's reported speed is held against what the bench's model makes of its command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpeedCheckConfig {
    /// Whether it is held; needs a model that was identified on this bench.
    pub on: bool,
    /// [-] standard deviations of the model's own error by which a speed may be off for ever.
    pub band: f64,
}

impl Default for SpeedCheckConfig {
    fn default() -> Self {
        Self { on: false, band: THRESHOLDS.speed_band }
    }
}
