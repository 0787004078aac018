//! Logs of a machine with more rotors than an attitude bench has: each rotor by itself.

use super::{Job, Progress, SessionError};
use crate::diagnose::{DiagnoseConfig, RotorDiagnoses, RotorDiagnosis};
use crate::model::Model;
use crate::screening::ScreenedLog;
use crate::screening::many_rotors::{beyond_bench, body_left_out, of_rotors};

/// The rotors of logs that are no attitude bench's, from 1: those that turn, where there are more than it has; else none.
#[must_use]
pub fn many_rotors(logs: &[ScreenedLog]) -> Vec<usize> {
    beyond_bench(logs)
}

/// Finds what the model is missing of each of `rotors`, and what they have in common.
///
/// # Errors
/// [`SessionError::Diagnose`] of the first rotor whose logs and model do not meet.
pub fn diagnose_each(
    model: &Model,
    (train, validate): (&[ScreenedLog], &[ScreenedLog]),
    rotors: &[usize],
    config: &DiagnoseConfig,
    job: &Job,
) -> Result<RotorDiagnoses, SessionError> {
    let mut found = Vec::new();
    let config = config.of_each(rotors.len());
    for (index, rotor) in rotors.iter().copied().enumerate() {
        job.report(Progress::Step { name: &format!("rotor {rotor}"), number: index + 1, of: rotors.len() });
        let [train, validate] = [train, validate].map(|logs| of_rotors(logs, &[rotor]));
        let diagnosis = super::diagnose::search(model, &train, &validate, &config, job)?;
        found.push(RotorDiagnosis { rotor, diagnosis });
    }
    let finding = body_left_out(train, rotors);
    if let (Some(first), Some(finding)) = (found.first_mut(), finding) {
        first.diagnosis.findings.push(finding);
    }
    Ok(RotorDiagnoses::of(found))
}
