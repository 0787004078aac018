//! What `design` says: its answer, notes and proposals in words.

mod page;

use std::fmt::Write as _;

use nalgebra::Complex;
use serde::Serialize;

use super::number;
use crate::control::design::{Advice, Improvement, Margins};
use crate::control::thresholds::THRESHOLDS;
use crate::control::{ControllerKind, PidConfig};

pub use page::{page, tables};

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

/// The answer as text, for a terminal.
#[must_use]
pub fn text(design: &Design) -> String {
    let mut text = String::new();
    tables(design).iter().for_each(|table| text += &format!("{}\n", table.text()));
    let said = [
        ("refused", &design.refusal),
        ("note", &design.note),
        ("warning", &design.warning),
        ("advice", &design.advice),
    ];
    for (what, sentence) in said {
        if let Some(sentence) = sentence {
            let _ = writeln!(text, "{what}: {sentence}");
        }
    }
    text
}

/// That the answer is of another controller than the bench has.
#[must_use]
pub fn pid_on_an_emc_bench() -> String {
    "--pid-margins makes a PID, and the bench's own controller is EMC; --controller pid says that it is meant"
        .to_owned()
}

/// That a loop is stable and of no use: what is left of a push fades with a time constant [s], by the eigenvalue beside it.
#[must_use]
pub fn sluggish(kind: ControllerKind, (fades_s, slowest): (f64, f64), margins: &Margins) -> String {
    let instead = match kind {
        ControllerKind::Emc => "take a larger γ_0, or smaller α and α_c",
        ControllerKind::Pid => "ask for smaller margins, or give larger gains",
    };
    format!(
        "the loop is stable and of little use: what a push leaves behind fades with a time constant of {} s (eigenvalue \
         1 - {:.1e}), at a bandwidth of {:.2} rad/s; {instead}",
        number(fades_s, 3),
        1.0 - slowest,
        margins.bandwidth_rad_s
    )
}

/// A change of one knob, and what becomes better.
#[must_use]
pub fn advice(advice: &Advice) -> String {
    let Advice { knob, from, to, improvement, .. } = advice;
    let verb = if to > from { "raise" } else { "lower" };
    let why = match improvement {
        Improvement::SensitivityPeak { from, to } => {
            let calm = THRESHOLDS.nervous_peak;
            format!("the sensitivity peak falls from {from:.2} to {to:.2}, below {calm} is calm")
        }
        Improvement::Bandwidth { from_rad_s, to_rad_s, sensitivity_peak } => format!(
            "the bandwidth grows from {from_rad_s:.1} to {to_rad_s:.1} rad/s, and the sensitivity peak stays at \
             {sensitivity_peak:.2}"
        ),
    };
    format!("{verb} {knob} from {from:.3} to {to:.3}: {why}")
}
