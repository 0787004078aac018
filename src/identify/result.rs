//! What goes into section III, and what comes out of it.

use serde::Serialize;

use super::dead_time::Delay;
use super::inertia::IdentifiedBody;
use super::joint_fit::JointFit;
use super::lag_order::LagAlternative;
use super::static_curve::StaticCurve;
use super::supply_gain::SupplyGain;
use super::thrust_curve::ThrustCurve;
use super::validate::Validation;
use super::voltage_gain::BatteryGain;
use super::{Estimate, IdentifiedActuator};
use crate::estimation::frequency_response::ResponsePoint;
use crate::model::Model;
use crate::screening::Finding;
use crate::signal::ROTORS;

/// What to identify from the logs, and what to take as given.
#[derive(Debug, Clone)]
pub struct IdentifySettings {
    /// Gives the full-battery voltage, the hover rate, the arm, and all that the logs do not show.
    pub template: Model,
    /// Whether its full-battery voltage was said of this bench, and is not the template's own.
    pub full_voltage_given: bool,
    /// Degree of g(u); `None` = cross-validation chooses.
    pub degree: Option<usize>,
    /// Whether the battery takes part (where its voltage was logged).
    pub battery: bool,
    /// Whether a transport delay that the data show goes into the model.
    pub delay: bool,
    /// Which rotors' columns to use, from 1; they are taken as identical, as the paper does.
    pub rotors: Vec<usize>,
}

impl IdentifySettings {
    /// Where the full-battery voltage comes from, for findings.
    pub(crate) fn full_voltage_from(&self) -> &'static str {
        if self.full_voltage_given { "option" } else { "template" }
    }
}

impl Default for IdentifySettings {
    fn default() -> Self {
        Self {
            template: Model::paper(),
            full_voltage_given: false,
            degree: None,
            battery: true,
            delay: true,
            rotors: (1..=ROTORS).collect(),
        }
    }
}

/// The pole from z to ω_p, [LPC16] section III.B, Eq. (10).
///
/// **Deviation:** from the data (10) the print fits the pole alone. Here a gain and an offset are fitted beside it,
/// so that a small error of the static curve does not move it; both are shown, and the model keeps gain 1.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct PoleFit {
    /// [rad/s]
    pub pole: Estimate,
    /// [-] gain from z to ω_p: 1 when the static curve holds in motion.
    pub gain: Estimate,
    /// [rad/s] offset fitted beside.
    pub offset: Estimate,
    /// [rad/s] rms of the residual.
    pub residual_rms: f64,
    /// Lag-one correlation of the residual: near zero when nothing is missing.
    pub residual_correlation: f64,
    /// Samples used.
    pub samples: usize,
    /// A delay and a second pole, tried.
    pub alternatives: Vec<LagAlternative>,
    /// The delay, where the data show one; pole, gain and offset then were fitted beside it.
    pub delay: Option<Delay>,
}

/// One step of section III: done, or why not.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PipelineStep {
    /// Code of the step: `voltage_gain`, `joint_estimation`, `static_curve`, `pole`, `thrust_curve`, `inertia`.
    #[serde(skip)]
    pub step: &'static str,
    /// Whether it was done.
    pub done: bool,
    /// What was done, or why it was not.
    #[serde(flatten)]
    pub finding: Finding,
}

/// All that the logs say.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct Identification {
    /// The steps of section III, and which of them the logs permit.
    pub parts: Vec<PipelineStep>,
    /// k_V by Eq. (6).
    pub battery: Option<BatteryGain>,
    /// k_V from levels at several supplies, a log each.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub supplies: Option<SupplyGain>,
    /// g(u) by Eq. (9).
    pub static_curve: Option<StaticCurve>,
    /// p by output error from z.
    pub pole: Option<PoleFit>,
    /// Joint estimation of all of them.
    pub joint: Option<JointFit>,
    /// The rotor as the model file gets it.
    pub actuator: IdentifiedActuator,
    /// Frequency response from z to the measured rate.
    pub frequency_response: Vec<ResponsePoint>,
    /// [s] median sampling interval of the logs with exciting commands.
    pub interval: f64,
    /// Thrust curve.
    pub thrust: Option<ThrustCurve>,
    /// Body.
    pub body: Option<IdentifiedBody>,
    /// How the result does on the logs it was fitted to.
    pub training: Vec<Validation>,
    /// How it does on other logs.
    pub validation: Vec<Validation>,
    /// What the reader must know.
    pub findings: Vec<Finding>,
    /// Each rotor by itself, of a machine with more of them than an attitude bench has.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rotors: Vec<RotorModel>,
    /// The model: the template with all that was identified.
    #[serde(skip)]
    pub model: Model,
}

/// One rotor of several, identified by itself.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct RotorModel {
    /// Its number in the logs, from 1.
    pub rotor: usize,
    /// The rotor as its model file gets it.
    pub actuator: IdentifiedActuator,
    /// How it does on the logs it was fitted to.
    pub training: Vec<Validation>,
    /// How it does on other logs.
    pub validation: Vec<Validation>,
    /// What to know of this rotor.
    pub findings: Vec<Finding>,
    /// The model: the template with what was identified of this rotor.
    #[serde(skip)]
    pub model: Model,
}

impl RotorModel {
    /// What was identified of one rotor.
    #[must_use]
    pub fn of(rotor: usize, found: Identification) -> Self {
        let Identification { actuator, training, validation, findings, model, .. } = found;
        Self { rotor, actuator, training, validation, findings, model }
    }
}
