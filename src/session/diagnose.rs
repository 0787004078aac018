//! Which physical effect is missing.

use super::modelled::Modelled;
use super::{Job, SessionError};
use crate::diagnose::{self, DiagnoseConfig, Diagnosis};
use crate::model::Model;
use crate::screening::ScreenedLog;

/// Finds what the model is missing; fitted on `train`, chosen on `validate`.
///
/// In a program: `examples/diagnose.rs`, and the [front page](crate#a-first-result).
///
/// # Errors
/// [`SessionError::Diagnose`] when model and logs do not meet.
pub fn diagnose(
    model: &Model,
    train: &[ScreenedLog],
    validate: &[ScreenedLog],
    config: &DiagnoseConfig,
    job: &Job,
) -> Result<Diagnosis, SessionError> {
    let logs = Modelled::of(train, validate);
    let mut found = search(model, &logs.train, &logs.validate, config, job)?;
    found.findings.extend(logs.finding);
    Ok(found)
}

pub(super) fn search(
    model: &Model,
    train: &[ScreenedLog],
    validate: &[ScreenedLog],
    config: &DiagnoseConfig,
    job: &Job,
) -> Result<Diagnosis, SessionError> {
    job.run(|| diagnose::diagnose(model, train, validate, config, &job.hear()))
}
