//! The whole of section III, as far as the logs reach.

use super::command_response::CommandResponses;
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
use crate::screening::Finding;
use crate::screening::ScreenedLog;
use crate::screening::duplicate_logs;
use crate::screening::excitation::FEWEST_JUMPS;
use crate::screening::rotor_data::RotorLog;

/// Steps of [`identify_with_progress`].
pub const STEPS: usize = 7;

/// Identifies what the logs permit; `validation` logs are only compared.
///
/// # Errors
/// [`IdentifyError`] when the logs permit nothing at all, with what each step lacks.
pub fn identify(
    logs: &[ScreenedLog],
    validation: &[ScreenedLog],
    settings: &IdentifySettings,
) -> Result<Identification, IdentifyError> {
    identify_with_progress(logs, validation, settings, &mut |_| ())
}

/// The same; `progress` hears the code of each of the [`STEPS`] as it begins.
///
/// # Errors
/// As [`identify`].
pub fn identify_with_progress(
    logs: &[ScreenedLog],
    validation: &[ScreenedLog],
    settings: &IdentifySettings,
    progress: &mut dyn FnMut(&'static str),
) -> Result<Identification, IdentifyError> {
    if let Some(degree) = settings.degree.filter(|degree| !(1..=HIGHEST_DEGREE).contains(degree)) {
        return Err(IdentifyError::Degree(degree));
    }
    if logs.is_empty() {
        return Err(IdentifyError::NoLog);
    }
    let mut copies = Vec::new();
    let logs = &duplicate_logs::without_copies(logs, &mut copies)[..];
    copies.extend(logs.iter().flat_map(ScreenedLog::channel_findings).cloned());
    let fuller = inputs::fuller_battery(logs, settings);
    let mut own = settings.clone();
    own.template.actuator.full_voltage = fuller.unwrap_or(settings.template.actuator.full_voltage);
    let mut work = Work::new(logs, &own, copies)?;
    let validation = &duplicate_logs::without_seen(logs, validation, &mut work.findings)[..];
    if let Some(volts) = fuller {
        work.findings.push(inputs::above_full(volts, settings));
    }
    let responses = CommandResponses::fit(&work.rotors, work.full_voltage());
    responses.refuse(None)?;
    let mismatch = responses.mismatch();
    let between_logs = if mismatch.is_none() { responses.mismatch_between_logs() } else { None };
    work.mismatch = mismatch.is_some();
    work.findings.extend(mismatch.or(between_logs));
    progress("voltage_gain");
    work.battery();
    progress("joint_estimation");
    work.joint();
    progress("static_curve");
    work.static_curve();
    progress("pole");
    work.pole();
    progress("thrust_curve");
    work.thrust();
    progress("inertia");
    let actuator = work.actuator();
    work.body(logs, &actuator);
    progress("validation");
    work.finish(logs, validation, actuator)
}

/// What is known so far.
pub(crate) struct Work<'a> {
    pub settings: &'a IdentifySettings,
    pub rotors: Vec<RotorLog>,
    pub excited: Vec<RotorLog>,
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
    pub insignificant_gain: Option<Estimate>,
    /// Whether rotors were found to differ, or to lead their commands: what a fit leaves over then has that reason.
    pub mismatch: bool,
    /// Logs in which the body was seen.
    pub body_logs: Vec<String>,
    /// What kept it from being seen in others.
    pub no_body: Vec<Finding>,
}

impl<'a> Work<'a> {
    fn new(
        logs: &[ScreenedLog],
        settings: &'a IdentifySettings,
        mut warnings: Vec<Finding>,
    ) -> Result<Self, IdentifyError> {
        let mut rotors = inputs::rotor_logs(logs, settings, &mut warnings)?;
        let use_battery = inputs::uses_battery(&rotors, settings, &mut warnings);
        if use_battery {
            warnings.extend(rotors.iter_mut().filter_map(quantized_voltage::mend));
        } else {
            rotors.iter_mut().for_each(|rotor| rotor.voltage = None);
        }
        let pole = settings.template.actuator.pole;
        let seldom: Vec<Finding> = rotors.iter().filter_map(|rotor| rotor.too_seldom(pole)).collect();
        let excited = rotors.iter().filter(|rotor| rotor.too_seldom(pole).is_none());
        let excited: Vec<RotorLog> =
            excited.filter(|rotor| rotor.jumps().len() >= FEWEST_JUMPS).cloned().collect();
        warnings.extend(seldom);
        Ok(Self {
            settings,
            rotors,
            excited,
            use_battery,
            parts: Vec::new(),
            findings: warnings,
            battery: None,
            joint: None,
            static_curve: None,
            pole: None,
            thrust: None,
            body: None,
            insignificant_gain: None,
            mismatch: false,
            body_logs: Vec::new(),
            no_body: Vec::new(),
        })
    }

    /// What a step came to.
    pub fn note(&mut self, step: &'static str, done: bool, finding: Finding) {
        self.parts.push(Part { step, done, finding });
    }

    /// Why a step found nothing.
    pub fn lacks(&mut self, step: &'static str, code: &'static str) {
        self.note(step, false, Finding::new(code, ""));
    }

    pub fn full_voltage(&self) -> f64 {
        self.settings.template.actuator.full_voltage
    }
}
