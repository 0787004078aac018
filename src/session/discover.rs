//! A law that no catalogue has.

use super::modelled::Modelled;
use super::{Job, SessionError};
use crate::diagnose::{DiagnoseConfig, step};
use crate::discover::{self, Discovery, LawVerdict};
use crate::identify::rotor_error;
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
    let mut found =
        job.run(|| discover::discover(model, &logs.train, &logs.validate, config, &job.hear()))?;
    // A law is a step of the ladder as any effect is: it can be looked at and taken back.
    if found.verdict == LawVerdict::Law {
        let effects = found.model.effects.iter().map(|added| &added.id).filter(|id| !model.has(id));
        let added: Vec<String> = effects.cloned().collect();
        let step = step(model, &added, [&logs.train, &logs.validate], &found.error);
        found.model.ladder.push(step);
        found.model.rotor_error = rotor_error(&found.model, &[&logs.train, &logs.validate]);
    }
    found.findings.extend(logs.finding);
    Ok(found)
}
