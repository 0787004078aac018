//! What the settings of the emulator are refused for.

use crate::unit::short;

/// What the emulator refuses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EmulateError {
    /// A parameter that must be above zero.
    #[error("emulator: `{name}` must be above zero, not {}", short(*value))]
    NotPositive {
        /// Key in its table.
        name: &'static str,
        /// Value found.
        value: f64,
    },
    /// A parameter that must not be negative.
    #[error("emulator: `{name}` must be zero or more, not {}", short(*value))]
    Negative {
        /// Key in its table.
        name: &'static str,
        /// Value found.
        value: f64,
    },
    /// A parameter outside its range.
    #[error("emulator: `{name}` must lie in {}..{}, not {}", short(*low), short(*high), short(*value))]
    Range {
        /// Key in its table.
        name: &'static str,
        /// Value found.
        value: f64,
        /// Lowest value allowed.
        low: f64,
        /// Highest value allowed.
        high: f64,
    },
    /// A static curve that is none.
    #[error("emulator: `steady_rate` must hold at most 8 numbers, by ascending power of the command")]
    Curve,
    /// A hidden effect that cannot be.
    #[error("emulator: hidden effect `{effect}`: {reason}")]
    Hidden {
        /// Its id.
        effect: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A sensor with an impossible rate, noise or quantization.
    #[error(
        "emulator: sensor `{name}` cannot have rate_hz = {rate_hz}, noise = {noise}, quantization = {quantization}"
    )]
    Sensor {
        /// Key in `[emulator.sensors]`.
        name: String,
        /// [Hz] found.
        rate_hz: f64,
        /// Noise found, in the sensor's unit.
        noise: f64,
        /// Quantization found, in the sensor's unit.
        quantization: f64,
    },
}
