//! What `design` finds.

use serde::Serialize;

use crate::control::design::{Advice, Improvement, Margins};
use crate::control::thresholds::THRESHOLDS;
use crate::control::{ControllerKind, PidConfig};
use crate::report::number;
use crate::session::{ControlDesign, ControlLoop, Eigenvalue, EmcDesign};

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

impl Design {
    /// What came of a loop, in numbers and sentences.
    #[must_use]
    pub fn of(task: &ControlLoop, made: &ControlDesign, note: Option<String>) -> Self {
        let closed = made.closed.as_ref();
        let of_little_use = closed.and_then(|closed| Some((closed.sluggish?, &closed.margins)));
        Self {
            model: task.model.clone(),
            controller: task.config.kind,
            period_s: task.period_s,
            delay_s: task.loop_plant.delay_s,
            stable: closed.is_some(),
            refusal: made.refusal.as_ref().map(ToString::to_string),
            emc: made.emc.clone(),
            pid: made.pid,
            closed_loop: closed.map_or_else(Vec::new, |closed| {
                closed.response.eigenvalues().iter().map(Eigenvalue::from).collect()
            }),
            margins: closed.map(|closed| closed.margins),
            note,
            warning: of_little_use.map(|(fades, margins)| sluggish(task.config.kind, fades, margins)),
            advice: closed.and_then(|closed| closed.advice.as_ref()).map(advice),
        }
    }
}

/// That a loop is stable and of no use: what is left of a push fades with a time constant [s], by the eigenvalue beside it.
fn sluggish(kind: ControllerKind, (fades_s, slowest): (f64, f64), margins: &Margins) -> String {
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
fn advice(advice: &Advice) -> String {
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
