//! How to compare.

use std::ops::RangeInclusive;

use super::thresholds::THRESHOLDS;

/// How to compare.
///
/// ```
/// use rotorbench::compare::CompareConfig;
///
/// // An unstable body runs away from any model: shorter windows. Its curves are not looked at.
/// let config = CompareConfig { horizon_s: 0.2, signals: false };
/// assert!(CompareConfig::HORIZONS_S.contains(&config.horizon_s));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompareConfig {
    /// [s] horizon of the windows of the body.
    pub horizon_s: f64,
    /// Whether the answer holds the signals sample by sample ([`Trace`](super::Trace), and those of [`UnknownTorque`](super::UnknownTorque)): of a long log they
    /// take more memory than the log.
    pub signals: bool,
}

impl CompareConfig {
    /// [s] horizons that make sense.
    pub const HORIZONS_S: RangeInclusive<f64> = THRESHOLDS.horizons_s.0..=THRESHOLDS.horizons_s.1;
}

impl Default for CompareConfig {
    fn default() -> Self {
        Self { horizon_s: THRESHOLDS.usual_horizon_s, signals: true }
    }
}
