//! Gains from complementary eigenvalues. [LPC16] Eqs. (22), (25)-(29).
//!
//! A complementary eigenvalue γ stands for the eigenvalue λ = 1 - γ: the larger, the faster.

use nalgebra::{Matrix3, Matrix4};
use serde::{Deserialize, Serialize};

use super::error::ControlError;

/// How β, the discrete pole of the embedded model's actuator, comes from the pole p and the period T_c.
///
/// **Deviation:** [LPC16] Table IV prints 0.27; 1 - exp(-p T_c) is 0.2739, p T_c is 0.32, and Table II needs
/// 0.276. So β is a design input: write `beta = 0.276` for Table II.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Beta {
    /// By rule, for whatever the period is.
    Rule(BetaRule),
    /// [-] as given; holds for one period only.
    Value(f64),
}

/// Discretization of the actuator pole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BetaRule {
    /// Zero-order hold: β = 1 - exp(-p T_c).
    ZeroOrderHold,
    /// Euler forward: β = p T_c.
    Euler,
}

impl Default for Beta {
    fn default() -> Self {
        Self::Rule(BetaRule::ZeroOrderHold)
    }
}

impl Beta {
    /// [-] the value for this pole [rad/s] and period [s].
    #[must_use]
    pub fn value(&self, pole: f64, period_s: f64) -> f64 {
        match *self {
            Self::Value(value) => value,
            Self::Rule(BetaRule::Euler) => pole * period_s,
            Self::Rule(BetaRule::ZeroOrderHold) => -(-pole * period_s).exp_m1(),
        }
    }
}

/// [-] γ_k = γ_0 2^(-k α), k = 0, 1, ... [LPC16] Eq. (27).
#[must_use]
pub fn complementary_eigenvalues<const N: usize>(gamma_0: f64, alpha: f64) -> [f64; N] {
    let mut gamma = [0.0; N];
    for (k, value) in gamma.iter_mut().enumerate() {
        *value = gamma_0 * (-(k as f64) * alpha).exp2();
    }
    gamma
}

/// [-] l_0..l_3 that give the state predictor the complementary eigenvalues `gamma`. [LPC16] Eq. (26).
#[must_use]
pub fn observer_gains(beta: f64, gamma: [f64; 4]) -> [f64; 4] {
    let [a, b, c, d] = gamma;
    // Π (γ + γ_k) = γ⁴ + s_3 γ³ + s_2 γ² + s_1 γ + s_0
    let s_3 = a + b + c + d;
    let s_2 = a * b + a * c + a * d + b * c + b * d + c * d;
    let s_1 = a * b * c + a * b * d + a * c * d + b * c * d;
    let s_0 = a * b * c * d;
    let l_1 = s_3 - beta;
    let l_3 = s_0 / beta;
    let l_2 = (s_1 - l_3) / beta;
    let l_0 = (s_2 - l_2) / beta - l_1;
    [l_0, l_1, l_2, l_3]
}

/// [-] k_1..k_3 that give A_c - B_c K the complementary eigenvalues `gamma`: its characteristic polynomial is
/// γ³ + β (1 + k_3) γ² + β k_2 γ + β k_1.
///
/// **Deviation:** [LPC16] Table III prints K = [0.276, 0.120, 0.052]. These are γ_0, γ_1, γ_2 of Table II, not
/// gains; A_c - B_c K would be unstable, |λ| = 1.171.
#[must_use]
pub fn feedback_gains(beta: f64, gamma: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = gamma;
    [a * b * c / beta, (a * b + a * c + b * c) / beta, (a + b + c) / beta - 1.0]
}

/// A_c - B_c K. [LPC16] Eqs. (22), (28).
#[must_use]
pub fn feedback_matrix(beta: f64, k: [f64; 3]) -> Matrix3<f64> {
    let a_c = Matrix3::new(1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0 - beta);
    let b_c_k = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, beta * k[0], beta * k[1], beta * k[2]);
    a_c - b_c_k
}

/// The state predictor's matrix, on [x_c2, x_c3, x_d1, x_d2]. [LPC16] Eq. (25).
#[rustfmt::skip]
#[must_use]
pub fn predictor_matrix(beta: f64, l: [f64; 4]) -> Matrix4<f64> {
    Matrix4::new(
        1.0 - l[1],   1.0,        1.0, 0.0,
        -beta * l[0], 1.0 - beta, 0.0, 0.0,
        -l[2],        0.0,        1.0, 1.0,
        -l[3],        0.0,        0.0, 1.0,
    )
}

/// Refuses a matrix with an eigenvalue on or outside the unit circle, and names it.
///
/// # Errors
/// [`ControlError::Unstable`].
pub fn require_stable(
    what: &'static str,
    eigenvalues: impl IntoIterator<Item = nalgebra::Complex<f64>>,
) -> Result<(), ControlError> {
    // `total_cmp` puts what is not a number above every number: no stable one either.
    let worst = eigenvalues.into_iter().max_by(|a, b| a.norm().total_cmp(&b.norm()));
    match worst.map(|worst| (worst, worst.norm())) {
        Some((worst, modulus)) if modulus >= 1.0 || modulus.is_nan() => {
            Err(ControlError::Unstable { what, real: worst.re, imaginary: worst.im, modulus })
        }
        _ => Ok(()),
    }
}
