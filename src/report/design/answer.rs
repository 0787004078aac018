//! What `design` finds.

use nalgebra::Complex;
use serde::Serialize;

use crate::control::design::Margins;
use crate::control::{ControllerKind, PidConfig};

/// The answer, as `--json` writes it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct Design {
    /// Name of the model.
    pub model: String,
    /// Which controller.
    pub controller: ControllerKind,
    /// [s] control period T_c.
    pub period_s: f64,
    /// [s] transport delay that the loop was closed with.
    pub delay_s: f64,
    /// Whether the closed loop is stable.
    pub stable: bool,
    /// Why there is no such loop.
    pub refusal: Option<String>,
    /// Gains, if it is EMC.
    pub emc: Option<EmcDesign>,
    /// Gains, if it is a PID.
    pub pid: Option<PidConfig>,
    /// Eigenvalues of the closed loop, slowest first.
    pub closed_loop: Vec<Eigenvalue>,
    /// How much more it stands.
    pub margins: Option<Margins>,
    /// What was not asked for.
    pub note: Option<String>,
    /// What makes it of little use.
    pub warning: Option<String>,
    /// What would make it better.
    pub advice: Option<String>,
}

/// Eigenvalues and gains of EMC.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct EmcDesign {
    /// [-] β.
    pub beta: f64,
    /// [-] complementary eigenvalues of the predictor.
    pub gamma: [f64; 4],
    /// [-] those of the feedback.
    pub gamma_c: [f64; 3],
    /// [-] l_0 to l_3.
    pub observer_gain: [f64; 4],
    /// [-] k_1 to k_3.
    pub feedback_gain: [f64; 3],
    /// Eigenvalues of the predictor.
    pub predictor: Vec<Eigenvalue>,
    /// Eigenvalues of the feedback.
    pub feedback: Vec<Eigenvalue>,
}

/// An eigenvalue of a discrete loop.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Eigenvalue {
    /// [-] real part.
    pub real: f64,
    /// [-] imaginary part.
    pub imaginary: f64,
    /// [-] distance from 0; below 1 is stable.
    pub modulus: f64,
}

impl From<&Complex<f64>> for Eigenvalue {
    fn from(value: &Complex<f64>) -> Self {
        Self { real: value.re, imaginary: value.im, modulus: value.norm() }
    }
}
