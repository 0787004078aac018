//! Settings of a diagnosis.

/// Settings of a diagnosis.
///
/// ```
/// use rotorbench::diagnose::DiagnoseConfig;
///
/// let config = DiagnoseConfig { horizon: 0.2 }; // [s] an unstable body
/// assert!(config.horizon < DiagnoseConfig::default().horizon);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnoseConfig {
    /// [s] length of the windows over which the body runs freely.
    pub horizon: f64,
}

impl Default for DiagnoseConfig {
    fn default() -> Self {
        // Long enough for weak torques to add up, short enough for an unstable body: facts of real benches.
        Self { horizon: 0.4 }
    }
}
