//! Findings as sentences. Each room's are in a file of its own, and those of a large one in a folder beside it; a code without a sentence shows its name.

mod compare;
mod diagnose;
mod fleet;
mod identify;
mod numbers;
mod refusal;
mod screening;
mod session;
mod studies;

pub(crate) use identify::driven_by;
pub use identify::step;
pub use refusal::{explained, refusal};

use crate::identify::PipelineStep;
use crate::screening::Finding;

/// The sentence of a finding, behind the names of its log and its rotor.
///
/// In a program: `examples/read_log.rs`.
#[must_use]
pub fn sentence(finding: &Finding) -> String {
    let place = finding.place();
    if place.is_empty() { text(finding) } else { format!("{place}: {}", text(finding)) }
}

/// The sentence of a finding where its log is known.
#[must_use]
pub fn text(finding: &Finding) -> String {
    screening::sentence(finding, text)
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

/// What became of a step, with what is kept of the template for it.
#[must_use]
pub fn outcome(part: &PipelineStep) -> String {
    let kept = match part.finding.code {
        "no_thrust" => "; the template's curve is kept",
        "inertia_not_significant" | "no_torque_moves_body" => "; the template's J is kept",
        _ => "",
    };
    // In a table there is room for what the step lacks only.
    format!("{}{kept}", identify::outcome(&part.finding).unwrap_or_else(|| text(&part.finding)))
}
