//! The whole of section III, as far as the logs reach.

use super::command_response::Alone;
use super::inertia::Body;
use super::inputs;
use super::joint_fit::JointFit;
use super::quantized_voltage;
use super::result::{Identification, IdentifySettings, Part, PoleFit};
use super::static_curve::StaticCurve;
use super::steady_rows::HIGHEST_DEGREE;
use super::thrust_curve::ThrustCurve;
use super::voltage_gain::BatteryGain;
use super::{Estimate, IdentifyError};
use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::duplicate_logs;
use crate::screening::excitation::FEWEST_JUMPS;
use crate::screening::rotor_data::RotorLog;
use crate::screening::screened;

/// Steps that [`identify_telling`] tells of.
pub const STEPS: usize = 7;

/// Identifies what the logs permit; `validation` logs are only compared.
///
/// # Errors
/// [`IdentifyError`] when the logs permit nothing at all, with what each step lacks.
pub fn identify(
    logs: &[Dataset],
    validation: &[Dataset],
    settings: &IdentifySettings,
) -> Result<Identification, IdentifyError> {
    identify_telling(logs, validation, settings, &mut |_| ())
}

/// The same; `tell` hears the name of each of the [`STEPS`] as it begins.
///
/// # Errors
/// As [`identify`].
pub fn identify_telling(
    logs: &[Dataset],
    validation: &[Dataset],
    settings: &IdentifySettings,
    tell: &mut dyn FnMut(&'static str),
) -> Result<Identification, IdentifyError> {
    if let Some(degree) = settings.degree.filter(|degree| !(1..=HIGHEST_DEGREE).contains(degree)) {
        return Err(IdentifyError::Degree(degree));
    }
    if logs.is_empty() {
        return Err(IdentifyError::NoLog);
    }
    let mut copies = Vec::new();
    let distinct = duplicate_logs::without_copies(logs, &mut copies);
    let logs = distinct.as_ref();
    let cleaned = screened(logs, &mut copies);
    let measured = cleaned.as_ref();
    let fuller = inputs::fuller_battery(logs, settings);
    let mut own = settings.clone();
    own.template.actuator.full_voltage = fuller.unwrap_or(settings.template.actuator.full_voltage);
    let mut work = Work::new(measured, &own, copies)?;
    let fresh = duplicate_logs::without_seen(logs, validation, &mut work.findings);
    let validation = fresh.as_ref();
    if let Some(volts) = fuller {
        work.findings.push(inputs::tell_of_fuller(volts, settings).into());
    }
    let alone = Alone::look(&work.rotors, work.full_voltage());
    alone.refuse(None)?;
    let said = alone.say();
    work.findings.extend(said.sentences.into_iter().map(Finding::from));
    work.unlike = said.unlike;
    tell("k_V from constant commands");
    work.battery();
    tell("g(u), k_V and p at once");
    work.joint();
    tell("g(u) from ramps");
    work.static_curve();
    tell("p from lively commands");
    work.pole();
    tell("thrust curve");
    work.thrust();
    tell("body");
    let actuator = work.actuator();
    work.body(measured, &actuator);
    tell("validation");
    work.finish(logs, validation, actuator)
}

/// What is known so far.
pub(crate) struct Work<'a> {
    pub settings: &'a IdentifySettings,
    pub rotors: Vec<RotorLog>,
    pub lively: Vec<RotorLog>,
    pub use_battery: bool,
    pub parts: Vec<Part>,
    pub findings: Vec<Finding>,
    pub battery: Option<BatteryGain>,
    pub joint: Option<JointFit>,
    pub static_curve: Option<StaticCurve>,
    pub pole: Option<PoleFit>,
    pub thrust: Option<ThrustCurve>,
    pub body: Option<Body>,
    /// A k_V that hardly shows in constant commands.
    pub hardly: Option<Estimate>,
    /// Whether rotors were found to differ, or to lead their commands: what a fit leaves over then has that reason.
    pub unlike: bool,
    /// Logs in which the body was seen, and what kept it from being seen in others.
    pub bodies: (Vec<String>, Vec<Finding>),
}

impl<'a> Work<'a> {
    fn new(
        logs: &[Dataset],
        settings: &'a IdentifySettings,
        mut warnings: Vec<Finding>,
    ) -> Result<Self, IdentifyError> {
        let mut rotors = inputs::rotor_logs(logs, settings, &mut warnings)?;
        let use_battery = inputs::uses_battery(&rotors, settings, &mut warnings);
        if use_battery {
            warnings.extend(rotors.iter_mut().filter_map(quantized_voltage::mend).map(Finding::from));
        } else {
            rotors.iter_mut().for_each(|rotor| rotor.voltage = None);
        }
        let lively: Vec<RotorLog> =
            rotors.iter().filter(|rotor| rotor.jumps().len() >= FEWEST_JUMPS).cloned().collect();
        Ok(Self {
            settings,
            rotors,
            lively,
            use_battery,
            parts: Vec::new(),
            findings: warnings,
            battery: None,
            joint: None,
            static_curve: None,
            pole: None,
            thrust: None,
            body: None,
            hardly: None,
            unlike: false,
            bodies: (Vec::new(), Vec::new()),
        })
    }

    pub fn note(&mut self, step: &'static str, done: bool, outcome: impl Into<String>) {
        self.parts.push(Part { step, outcome: outcome.into(), done });
    }

    pub fn full_voltage(&self) -> f64 {
        self.settings.template.actuator.full_voltage
    }
}
