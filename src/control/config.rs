//! The `[controller]` table of the bench file, as people write it.

use serde::{Deserialize, Serialize};

use super::error::{ControlError, require_not_negative};
use super::gains::Beta;
use super::reference::ReferenceConfig;

/// Which controller runs.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ControllerKind {
    /// Embedded Model Control, [LPC16] section IV.A.
    #[default]
    Emc,
    /// PID, [LPC16] section IV.B.
    Pid,
}

/// The `[controller]` table of the bench file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {
    /// Which controller runs.
    pub kind: ControllerKind,
    /// Settings of EMC.
    pub emc: EmcConfig,
    /// Settings of PID.
    pub pid: PidConfig,
    /// What the angle should do.
    pub reference: ReferenceConfig,
    /// Correct the integrated angle slowly by `Sensors::body_angle`, where the bench measures it. Off: the angle
    /// is the integral of the gyro, as in [LPC16], and a gyro bias walks it away.
    pub use_body_angle: bool,
    /// Cancel what the model's effects say, where a controller can (see [`Compensation`](super::Compensation)).
    pub compensate: bool,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self {
            kind: ControllerKind::default(),
            emc: EmcConfig::default(),
            pid: PidConfig::default(),
            reference: ReferenceConfig::default(),
            use_body_angle: false,
            compensate: true,
        }
    }
}

impl ControllerConfig {
    /// EMC as [LPC16] Table II has it: β = γ_0 = 0.276 at T_c = 0.02 s.
    #[must_use]
    pub fn paper() -> Self {
        Self { emc: EmcConfig { beta: Beta::Value(0.276), ..EmcConfig::default() }, ..Self::default() }
    }
}

/// The `[controller.emc]` table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EmcConfig {
    /// [-] discrete pole of the embedded actuator: `"zero_order_hold"` (default), `"euler"`, or a number.
    pub beta: Beta,
    /// [-] γ_0, the fastest complementary eigenvalue of predictor and feedback; unset = β, so that the
    /// actuator's own dynamics is left as it is.
    pub gamma_0: Option<f64>,
    /// [-] α ≥ 0 spreads the predictor's eigenvalues: larger = slower, less noise. [LPC16] Eq. (27).
    pub alpha: f64,
    /// [-] α_c ≥ 0 does the same for the feedback.
    pub alpha_c: f64,
    /// [-] K as given, in place of the pole placement.
    pub feedback_gain: Option<[f64; 3]>,
}

impl Default for EmcConfig {
    fn default() -> Self {
        Self { beta: Beta::default(), gamma_0: None, alpha: 1.2, alpha_c: 0.0, feedback_gain: None }
    }
}

/// The `[controller.pid]` table. The defaults are those of [LPC16] Table III.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PidConfig {
    /// [N m/rad] k_P.
    pub k_p: f64,
    /// [N m/(rad s)] k_I.
    pub k_i: f64,
    /// [N m s/rad] k_D, on the measured rate.
    pub k_d: f64,
}

impl Default for PidConfig {
    fn default() -> Self {
        Self { k_p: 2.248, k_i: 0.985, k_d: 0.574 }
    }
}

impl PidConfig {
    /// Refuses gains that are negative or no numbers.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] names the gain.
    pub fn validate(&self) -> Result<(), ControlError> {
        require_not_negative("k_p", self.k_p)?;
        require_not_negative("k_i", self.k_i)?;
        require_not_negative("k_d", self.k_d)
    }
}
