//! Which physical effect is missing.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::modelled::Modelled;
use super::{Job, Progress, SessionError};
use crate::diagnose::{self, DiagnoseConfig, Diagnosis, SearchEvent};
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
    let fitted = AtomicUsize::new(0);
    let hear = |event: SearchEvent| match event {
        SearchEvent::Fitted => {
            job.report(Progress::Candidate { fitted: 1 + fitted.fetch_add(1, Ordering::Relaxed) })
        }
        SearchEvent::Tried { effects, over_noise } => job.report(Progress::Tried { effects, over_noise }),
        SearchEvent::Leading(effects) => job.report(Progress::Leading { effects }),
    };
    job.run(|| diagnose::diagnose(model, train, validate, config, &hear))
}
