//! What is run of the paper.

/// [s] T_s and T_c. [LPC16] Eq. (3), Table IV.
pub const PERIOD_S: f64 = 0.02;
/// [s] when the impulse strikes.
pub const IMPULSE_AT_S: f64 = 5.0;
/// [s] [N m] the impulse.
pub const IMPULSE: (f64, f64) = (0.05, 0.6);

/// What to run.
#[derive(Debug, Clone)]
pub struct PaperSettings {
    /// Seed of the emulated bench's noise.
    pub seed: u64,
    /// [s] length of the PRBS; the paper's is 2400.
    pub prbs_s: f64,
    /// [s] length of each of the six constant commands.
    pub hold_s: f64,
}
