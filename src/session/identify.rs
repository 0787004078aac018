//! Actuator and body from logs.

use super::modelled::Modelled;
use super::{Job, Progress, SessionError};
use crate::identify::{Identification, IdentifySettings, RotorModel, STEPS, identify_with_progress};
use crate::screening::ScreenedLog;

/// Identifies what the logs permit; `validation` logs are only compared. Of a machine with more rotors than an attitude bench
/// has, what all have in common, and each rotor by itself.
///
/// # Errors
/// [`SessionError::Identify`] when the logs permit nothing.
pub fn identify(
    logs: &[ScreenedLog],
    validation: &[ScreenedLog],
    settings: &IdentifySettings,
    job: &Job,
) -> Result<Identification, SessionError> {
    let modelled = Modelled::of(logs, validation);
    let mut found = of_rotors(&modelled, settings, job)?;
    found.findings.extend(modelled.finding.clone());
    let each = modelled.rotors.iter().copied().filter(|rotor| settings.rotors.contains(rotor));
    let each: Vec<usize> = each.collect();
    for rotor in each.iter().copied().filter(|_| each.len() > 1) {
        let own = IdentifySettings { rotors: vec![rotor], ..settings.clone() };
        let own = of_rotors(&modelled, &own, job)?;
        found.rotors.push(RotorModel::of(rotor, own));
    }
    Ok(found)
}

fn of_rotors(
    logs: &Modelled,
    settings: &IdentifySettings,
    job: &Job,
) -> Result<Identification, SessionError> {
    let mut number = 0;
    job.run(|| {
        identify_with_progress(&logs.train, &logs.validate, settings, &mut |name| {
            number += 1;
            job.tell(Progress::Step { name, number, of: STEPS });
        })
    })
}
