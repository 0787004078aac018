//! Findings as sentences. Each room's are in a file of its own; a code without a sentence is told by its name and numbers.

mod compare;
mod diagnose;
mod identify;
mod screening;

use crate::screening::Finding;
use crate::screening::finding::SENTENCE;

/// The sentence of a finding, behind the name of its log.
#[must_use]
pub fn sentence(finding: &Finding) -> String {
    let text = said(finding);
    if finding.log.is_empty() { text } else { format!("{}: {text}", finding.log) }
}

fn said(finding: &Finding) -> String {
    if finding.code == SENTENCE {
        return finding.text("text").to_owned();
    }
    screening::sentence(finding)
        .or_else(|| identify::sentence(finding))
        .or_else(|| compare::sentence(finding))
        .or_else(|| diagnose::sentence(finding))
        .unwrap_or_else(|| format!("{} {}", finding.code, finding.subject))
}

/// The sentences of several.
#[must_use]
pub fn sentences(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(sentence).collect()
}
