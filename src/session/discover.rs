//! A law that no catalogue has.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::modelled::Modelled;
use super::{Job, Progress, SessionError};
use crate::diagnose::{DiagnoseConfig, Event};
use crate::discover::{self, Discovery};
use crate::model::Model;
use crate::screening::ScreenedLog;

/// Finds the law itself where no effect of the catalogue explains what the model is missing; fitted on `train`, chosen on `validate`.
///
/// # Errors
/// [`SessionError::Diagnose`] when model and logs do not meet.
pub fn discover(
    model: &Model,
    train: &[ScreenedLog],
    validate: &[ScreenedLog],
    config: &DiagnoseConfig,
    job: &Job,
) -> Result<Discovery, SessionError> {
    let logs = Modelled::of(train, validate);
    let fitted = AtomicUsize::new(0);
    let hear = |event: Event| match event {
        Event::Fitted => {
            job.report(Progress::Candidate { fitted: 1 + fitted.fetch_add(1, Ordering::Relaxed) })
        }
        Event::Leading(effects) => job.report(Progress::Leading { effects }),
    };
    let mut found = job.run(|| discover::discover(model, &logs.train, &logs.validate, config, &hear))?;
    found.findings.extend(logs.finding);
    Ok(found)
}
