//! Findings as sentences. Each room's are in a file of its own, and those of a large one in a folder beside it; a code without a sentence shows its name.

mod compare;
mod diagnose;
mod fleet;
mod identify;
mod numbers;
mod screening;
mod session;
mod studies;

pub use identify::step;
pub(crate) use identify::{driven_by, outcome};

use std::error::Error;

use crate::diagnose::DiagnoseError;
use crate::fleet::FleetError;
use crate::identify::IdentifyError;
use crate::screening::{Finding, ScreeningError};
use crate::session::SessionError;
use crate::studies::paper::PaperError;

/// The sentence of a finding, behind the names of its log and its rotor.
#[must_use]
pub fn sentence(finding: &Finding) -> String {
    let place = finding.place();
    if place.is_empty() { text(finding) } else { format!("{place}: {}", text(finding)) }
}

/// The sentence of a finding where its log is known.
#[must_use]
pub fn text(finding: &Finding) -> String {
    screening::sentence(finding)
        .or_else(|| identify::sentence(finding))
        .or_else(|| compare::sentence(finding))
        .or_else(|| diagnose::sentence(finding))
        .or_else(|| session::sentence(finding))
        .or_else(|| studies::sentence(finding))
        .or_else(|| fleet::sentence(finding))
        .unwrap_or_else(|| format!("{} {}", finding.code, finding.subject))
}

/// The sentences of several.
#[must_use]
pub fn sentences(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(sentence).collect()
}

/// An error and its causes in one sentence.
#[must_use]
pub fn explained(error: &(dyn Error + 'static)) -> String {
    let mut sentence = refusal(error).unwrap_or_else(|| error.to_string());
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !sentence.contains(&cause_text) {
            sentence.push_str(": ");
            sentence.push_str(&cause_text);
        }
        source = cause.source();
    }
    sentence
}

/// What an error says whose reason is a finding; `None` of one that speaks for itself.
#[must_use]
pub fn refusal(error: &(dyn Error + 'static)) -> Option<String> {
    if let Some(FleetError::Session(error)) = error.downcast_ref::<FleetError>() {
        return refusal(error);
    }
    match error.downcast_ref::<SessionError>() {
        Some(SessionError::Identify(error)) => return refusal(error),
        Some(SessionError::Diagnose(error)) => return refusal(error),
        _ => {}
    }
    if let Some(DiagnoseError::Column(error)) = error.downcast_ref::<DiagnoseError>() {
        return refusal(error);
    }
    if let Some(PaperError::Identify(error)) = error.downcast_ref::<PaperError>() {
        return refusal(error);
    }
    match error.downcast_ref::<IdentifyError>()? {
        IdentifyError::Screening(ScreeningError::Column(finding)) => Some(sentence(finding)),
        IdentifyError::Nothing { reasons, steps } => Some(identify::nothing(reasons, steps)),
        _ => None,
    }
}
