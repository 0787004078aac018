//! Actuator and body from logs.

use super::modelled::Modelled;
use super::{Job, Progress, SessionError};
use crate::identify::{
    Identification, IdentifyError, IdentifySettings, RotorModel, STEPS, identify_with_progress,
};
use crate::screening::{Finding, ScreenedLog};

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
    let each = modelled.rotors.iter().copied().filter(|rotor| settings.rotors.contains(rotor));
    let each: Vec<usize> = each.collect();
    let all = of_rotors(&modelled, settings, job);
    let mut found = if each.len() > 1 { each_rotor(all, &each, &modelled, settings, job)? } else { all? };
    found.findings.extend(modelled.finding.clone());
    Ok(found)
}

/// What all rotors are together, with each by itself. Where no one model holds for all of them, that of the first which has one
/// stands in its place.
fn each_rotor(
    all: Result<Identification, SessionError>,
    each: &[usize],
    logs: &Modelled,
    settings: &IdentifySettings,
    job: &Job,
) -> Result<Identification, SessionError> {
    let (mut own, mut without) = (Vec::new(), Vec::new());
    for rotor in each.iter().copied() {
        match of_rotors(logs, &IdentifySettings { rotors: vec![rotor], ..settings.clone() }, job) {
            Ok(found) => own.push((rotor, found)),
            Err(SessionError::Identify(IdentifyError::Nothing { .. })) => {
                without.push(Finding::new("rotor_not_identified", format!("rotor {rotor}")));
            }
            Err(other) => return Err(other),
        }
    }
    let mut found = match (all, own.first()) {
        (Err(SessionError::Identify(IdentifyError::Nothing { .. })), Some((rotor, first))) => {
            let differ = Finding::new("no_common_model", "rotors").with("rotor", *rotor);
            Identification { findings: [&[differ], &first.findings[..]].concat(), ..first.clone() }
        }
        (all, _) => all?,
    };
    found.findings.extend(without);
    found.rotors = own.into_iter().map(|(rotor, own)| RotorModel::of(rotor, own)).collect();
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
