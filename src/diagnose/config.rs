//! Settings of a diagnosis.

use super::thresholds::THRESHOLDS;

/// Settings of a diagnosis.
///
/// ```
/// use rotorbench::diagnose::DiagnoseConfig;
///
/// let config = DiagnoseConfig { horizon: 0.2, ..DiagnoseConfig::default() }; // [s] an unstable body
/// assert!(config.horizon < DiagnoseConfig::default().horizon);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnoseConfig {
    /// [s] length of the windows over which the body runs freely.
    pub horizon: f64,
    /// Rows that a search goes over at least; of logs with more than twice as many it sees stretches, and all rows decide in the end.
    pub searched_rows: usize,
}

impl Default for DiagnoseConfig {
    fn default() -> Self {
        // Long enough for weak torques to add up, short enough for an unstable body: facts of real benches.
        Self { horizon: 0.4, searched_rows: THRESHOLDS.searched_rows }
    }
}
