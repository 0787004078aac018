//! `--json`: answers with the version of their form, and with the sentences beside the codes.

use serde::Serialize;
use serde_json::{Value, json};

use super::findings::sentences;
use crate::screening::Finding;

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
    Ok(value)
}

/// The text of an answer, with `schema` in it.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn answer(answer: &impl Serialize) -> Result<String, serde_json::Error> {
    let mut value = serde_json::to_value(answer)?;
    if let Value::Object(fields) = &mut value {
        fields.insert("schema".to_owned(), json!(SCHEMA));
    }
    serde_json::to_string_pretty(&value)
}
