//! Actuator and body from logs.

use super::modelled::Modelled;
use super::thresholds::THRESHOLDS;
use super::{Job, Progress, SessionError};
use crate::estimation::moments::pooled_rms;
use crate::identify::{
    Identification, IdentifyError, IdentifySettings, RotorModel, STEPS, Validation, identify_with_progress,
};
use crate::screening::{Finding, ScreenedLog};

/// The code: rotors that no one model holds for.
const NO_COMMON_MODEL: &str = "no_common_model";

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
            let differ = Finding::new(NO_COMMON_MODEL, "rotors").with("rotor", *rotor);
            Identification { findings: [&[differ], &first.findings[..]].concat(), ..first.clone() }
        }
        (all, _) => all?,
    };
    found.findings.extend(without);
    let common: Vec<Validation> = if found.findings.iter().any(|it| it.code == NO_COMMON_MODEL) {
        Vec::new()
    } else {
        found.training.clone()
    };
    found.findings.extend(own.iter().filter_map(|(rotor, own)| differs(*rotor, &common, &own.training)));
    found.rotors = own.into_iter().map(|(rotor, own)| RotorModel::of(rotor, own)).collect();
    Ok(found)
}

/// Says that the model of all rotors is a worse one of this rotor than its own, or its own a worse one than that.
fn differs(rotor: usize, common: &[Validation], own: &[Validation]) -> Option<Finding> {
    let of_own = |run: &Validation| common.iter().find(|it| it.source == run.source);
    let pairs: Vec<_> = own.iter().filter_map(|own| Some((of_own(own)?.rms, own.rms, own.samples))).collect();
    let all = pooled_rms(pairs.iter().map(|(all, _, samples)| (*all, *samples)));
    let own = pooled_rms(pairs.iter().map(|(_, own, samples)| (*own, *samples)));
    let code = match THRESHOLDS.models_differ {
        worse if all > worse * own => "rotor_differs_from_all",
        worse if own > worse * all => "own_model_worse",
        _ => return None,
    };
    Some(Finding::of_rotor(code, rotor).with("rms_of_all", all).with("rms_of_own", own))
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
            job.report(Progress::Step { name, number, of: STEPS });
        })
    })
}
