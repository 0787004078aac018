//! The whole of section III, as far as the logs reach.

use super::IdentifyError;
use super::command_timing::RATES_LEAD;
use super::inputs;
use super::mistaken_columns::{beside_logs, suspicions};
use super::result::{Identification, IdentifySettings};
use super::steady_rows::HIGHEST_DEGREE;
use super::work::Work;
use crate::screening::ScreenedLog;
use crate::screening::duplicate_logs;
use crate::screening::suspicion::Stops;

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
    let judged = [logs, validation].map(|logs| suspicions(logs, &settings.template, &settings.rotors));
    judged.iter().try_for_each(|found| found.refuse(Stops::Fits))?;
    let leads = judged[0].findings().any(|it| it.code == RATES_LEAD);
    let mut copies = beside_logs(&judged[0], logs);
    copies.extend(beside_logs(&judged[1], validation));
    let logs = &duplicate_logs::without_copies(logs, &mut copies)[..];
    copies.extend(logs.iter().flat_map(ScreenedLog::channel_findings).cloned());
    let fuller = inputs::fuller_battery(logs, &settings.template);
    let mut own = settings.clone();
    own.template.actuator.full_voltage = fuller.unwrap_or(settings.template.actuator.full_voltage);
    let mut work = Work::new(logs, &own, copies);
    let validation = &duplicate_logs::without_seen(logs, validation, &mut work.findings)[..];
    if let Some(volts) = fuller {
        work.findings.push(inputs::above_full(volts, settings));
    }
    work.compare_rotors(leads);
    progress("voltage_gain");
    work.battery();
    progress("joint_estimation");
    work.joint();
    work.without_impossible_battery();
    progress("static_curve");
    work.static_curve();
    progress("pole");
    work.pole();
    progress("thrust_curve");
    work.thrust(logs);
    progress("inertia");
    let actuator = work.actuator();
    work.body(logs, &actuator);
    work.say_units(logs.iter().chain(validation));
    progress("validation");
    work.finish(logs, validation, actuator)
}
