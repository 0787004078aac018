//! A model with more effects, or with its own numbers refitted.

use super::modelled::Modelled;
use super::thresholds::THRESHOLDS;
use super::{Job, SessionError};
use crate::diagnose::{self, DiagnoseConfig, DiagnoseError, Extension};
use crate::model::Model;
use crate::screening::requirements::repeated;
use crate::screening::{Finding, ScreenedLog};

/// An extended or refitted model.
///
/// Printed by `examples/diagnose.rs`.
#[derive(Debug, Clone)]
pub struct Extended {
    /// The model, and its error before and after.
    pub extension: Extension,
    /// What to know about the logs and about the answer.
    pub findings: Vec<Finding>,
    /// Whether the error on the validation logs fell by more than noise gives.
    pub has_fallen: bool,
}

/// Adds the effects `ids` to `model` and refits everything.
///
/// In a program: `examples/diagnose.rs`.
///
/// # Errors
/// [`SessionError::Diagnose`] when an effect is unknown or there already, or the logs lack what it needs.
pub fn extend(
    model: &Model,
    ids: &[String],
    (train, validate): (&[ScreenedLog], &[ScreenedLog]),
    config: &DiagnoseConfig,
    job: &Job,
) -> Result<Extended, SessionError> {
    let logs = Modelled::of(train, validate);
    let extended = job.run(|| diagnose::extend(model, ids, &logs.train, &logs.validate, config));
    let extension = extended.map_err(|error| with_findings_of_logs(error, &logs))?;
    let findings = findings(&extension, &logs);
    // Where nothing but noise is left, refitted numbers may have got there, too.
    let beaten = if extension.is_at_floor { extension.error.base } else { extension.error.refitted };
    let has_fallen = extension.error.extended.validate < THRESHOLDS.fallen_share * beaten.validate;
    Ok(Extended { extension, findings, has_fallen })
}

/// Refits the model's own numbers, those whose change the logs ask for.
///
/// As [`extend`], without effects.
///
/// # Errors
/// [`SessionError::Diagnose`] when there is nothing to refit.
pub fn refit(
    model: &Model,
    (train, validate): (&[ScreenedLog], &[ScreenedLog]),
    config: &DiagnoseConfig,
    job: &Job,
) -> Result<Extended, SessionError> {
    let logs = Modelled::of(train, validate);
    let refitted = job.run(|| diagnose::extend(model, &[], &logs.train, &logs.validate, config));
    let extension = refitted.map_err(|error| with_findings_of_logs(error, &logs))?;
    let mut findings = findings(&extension, &logs);
    let (error, is_at_floor) = (&extension.error, extension.is_at_floor);
    if !is_at_floor {
        let ratio = error.extended.validate / error.noise_floor;
        findings.push(Finding::new("refitted_above_noise_floor", "").with("error_over_noise_floor", ratio));
    }
    let falls = error.extended.validate < THRESHOLDS.fallen_share * error.base.validate;
    Ok(Extended { has_fallen: falls && is_at_floor, findings, extension })
}

/// Where no number has to change, that is what was found; and the logs may be why.
fn with_findings_of_logs(mut error: SessionError, logs: &Modelled) -> SessionError {
    if let SessionError::Diagnose(DiagnoseError::NothingChanged { findings, .. }) = &mut error {
        let nothing = Finding::new("nothing_to_change", "");
        findings.splice(0..0, std::iter::once(nothing).chain(of_logs(logs)));
    }
    error
}

fn findings(extension: &Extension, logs: &Modelled) -> Vec<Finding> {
    of_logs(logs).chain(extension.findings.iter().cloned()).collect()
}

fn of_logs(logs: &Modelled) -> impl Iterator<Item = Finding> {
    repeated(&logs.train, &logs.validate).into_iter().chain(logs.finding.clone())
}
