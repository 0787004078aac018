//! What `design` finds.

use serde::Serialize;

use crate::control::design::Margins;
use crate::control::{ControllerKind, PidConfig};
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
        let sluggish = closed.and_then(|closed| Some((closed.sluggish?, &closed.margins)));
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
            warning: sluggish.map(|(fades, margins)| super::sluggish(task.config.kind, fades, margins)),
            advice: closed.and_then(|closed| closed.advice.as_ref()).map(super::advice),
        }
    }
}
