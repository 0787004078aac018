//! The whole of section III, as far as the logs reach.

use super::alone::Alone;
use super::battery::BatteryGain;
use super::body::Body;
use super::intake;
use super::joint::JointFit;
use super::outcome::{Identification, IdentifySettings, Part, PoleFit};
use super::rotor_log::RotorLog;
use super::staircase;
use super::stale;
use super::static_curve::{HIGHEST_DEGREE, StaticCurve};
use super::thrust::ThrustCurve;
use super::used;
use super::{Estimate, IdentifyError};
use crate::record::{Dataset, readings};

/// Jumps of the command from which a pole may be fitted.
pub(super) const FEWEST_JUMPS: usize = 8;
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
    let distinct = used::without_copies(logs, &mut copies);
    let logs = distinct.as_ref();
    // A dropout is told as one, and not as something wild.
    let turning = stale::without_stale(logs, &settings.rotors, &mut copies);
    let cleaned = readings::measured_all(&turning, &mut copies);
    let measured = cleaned.as_ref();
    let fuller = intake::fuller_battery(logs, settings);
    let mut own = settings.clone();
    own.template.actuator.full_voltage = fuller.unwrap_or(settings.template.actuator.full_voltage);
    let mut work = Work::new(measured, &own, copies)?;
    let fresh = used::without_seen(logs, validation, &mut work.warnings);
    let validation = fresh.as_ref();
    if let Some(volts) = fuller {
        work.warnings.push(intake::tell_of_fuller(volts, settings));
    }
    let alone = Alone::look(&work.rotors, work.full_voltage());
    alone.refuse(None)?;
    let said = alone.say();
    work.warnings.extend(said.sentences);
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
pub(super) struct Work<'a> {
    pub settings: &'a IdentifySettings,
    pub rotors: Vec<RotorLog>,
    pub lively: Vec<RotorLog>,
    pub use_battery: bool,
    pub parts: Vec<Part>,
    pub warnings: Vec<String>,
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
    pub bodies: [Vec<String>; 2],
}

impl<'a> Work<'a> {
    fn new(
        logs: &[Dataset],
        settings: &'a IdentifySettings,
        mut warnings: Vec<String>,
    ) -> Result<Self, IdentifyError> {
        let mut rotors = intake::rotor_logs(logs, settings, &mut warnings)?;
        let use_battery = intake::uses_battery(&rotors, settings, &mut warnings);
        if use_battery {
            warnings.extend(rotors.iter_mut().filter_map(staircase::mend));
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
            warnings,
            battery: None,
            joint: None,
            static_curve: None,
            pole: None,
            thrust: None,
            body: None,
            hardly: None,
            unlike: false,
            bodies: [Vec::new(), Vec::new()],
        })
    }

    pub fn note(&mut self, step: &'static str, done: bool, outcome: impl Into<String>) {
        self.parts.push(Part { step, outcome: outcome.into(), done });
    }

    pub fn full_voltage(&self) -> f64 {
        self.settings.template.actuator.full_voltage
    }
}
