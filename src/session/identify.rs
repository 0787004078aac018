//! Actuator and body from logs.

use super::{Job, Progress, SessionError};
use crate::identify::{Identification, IdentifySettings, STEPS, identify_with_progress};
use crate::screening::ScreenedLog;

/// Identifies what the logs permit; `validation` logs are only compared.
///
/// # Errors
/// [`SessionError::Identify`] when the logs permit nothing.
pub fn identify(
    logs: &[ScreenedLog],
    validation: &[ScreenedLog],
    settings: &IdentifySettings,
    job: &Job,
) -> Result<Identification, SessionError> {
    let mut number = 0;
    job.run(|| {
        identify_with_progress(logs, validation, settings, &mut |name| {
            number += 1;
            job.tell(Progress::Step { name, number, of: STEPS });
        })
    })
}
