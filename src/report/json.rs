//! `--json`: answers with the version of their form, and with the sentences beside the codes.

use serde::Serialize;
use serde_json::{Value, json};

use super::comparison::run;
use super::findings::{sentences, text};
use super::measure::say_measures;
use crate::compare::Comparison;
use crate::diagnose::Diagnosis;
use crate::screening::Finding;
use crate::studies::jitter::Jitter;

/// Version of the form of all answers: it rises when a field goes or changes its meaning.
pub const SCHEMA: u32 = 2;

/// An answer with `warnings`, the sentences of its `findings`.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn with_sentences(answer: &impl Serialize, findings: &[Finding]) -> Result<Value, serde_json::Error> {
    let mut value = serde_json::to_value(answer)?;
    if let Value::Object(fields) = &mut value {
        fields.insert("warnings".to_owned(), json!(sentences(findings)));
    }
    say_measures(&mut value);
    Ok(value)
}

/// A comparison with the sentences of its findings, and how each block was run in words.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn comparison(comparison: &Comparison) -> Result<Value, serde_json::Error> {
    let findings = [&comparison.findings[..], &comparison.mistaken_columns].concat();
    let mut value = with_sentences(comparison, &findings)?;
    for (at, block) in comparison.blocks.iter().enumerate() {
        value["blocks"][at]["run"] = json!(run(block.run));
    }
    Ok(value)
}

/// A diagnosis with the sentences of its findings, and of each candidate's refusal as its `note`.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn diagnosis(diagnosis: &Diagnosis) -> Result<Value, serde_json::Error> {
    let mut value = with_sentences(diagnosis, &diagnosis.findings)?;
    let candidates = value.get_mut("candidates").and_then(Value::as_array_mut).into_iter().flatten();
    for (fields, candidate) in candidates.zip(&diagnosis.candidates) {
        let note = candidate.refusal.as_ref().map_or_else(String::new, ToString::to_string);
        fields["note"] = json!(note);
    }
    Ok(value)
}

/// A measurement of timing with the sentences of what was not measured.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn jitter(jitter: &Jitter) -> Result<Value, serde_json::Error> {
    let mut value = serde_json::to_value(jitter)?;
    let not_measured = |finding: &Option<Finding>| json!(finding.as_ref().map(text));
    for (at, stage) in jitter.stages.iter().enumerate() {
        value["stages"][at]["not_measured"] = not_measured(&stage.finding);
    }
    value["cyclictest"]["not_measured"] = not_measured(&jitter.cyclictest.finding);
    Ok(value)
}

/// The text of an answer, with `schema` in it; of a list, in each of its objects.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn answer(answer: &impl Serialize) -> Result<String, serde_json::Error> {
    serde_json::to_string_pretty(&with_version(answer)?)
}

/// The same on one line, for a command that answers again and again.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn line(answer: &impl Serialize) -> Result<String, serde_json::Error> {
    serde_json::to_string(&with_version(answer)?)
}

fn with_version(answer: &impl Serialize) -> Result<Value, serde_json::Error> {
    let mut value = serde_json::to_value(answer)?;
    let objects = match &mut value {
        Value::Array(rows) => rows.as_mut_slice(),
        one => std::slice::from_mut(one),
    };
    for fields in objects.iter_mut().filter_map(Value::as_object_mut) {
        fields.insert("schema".to_owned(), json!(SCHEMA));
    }
    say_measures(&mut value);
    Ok(value)
}
