//! Whether an answer fits its JSON Schema: the part of JSON Schema that our own schemas use, and a panic for any other word.

use serde_json::{Map, Value};

/// Words that say nothing about which values fit.
const SILENT: [&str; 5] = ["$schema", "title", "description", "default", "$defs"];

/// The answer of a command, held against the schema `docs/schema/NAME.json`.
pub fn answer(name: &str, said: impl AsRef<[u8]>) -> Value {
    let said = said.as_ref();
    let value = serde_json::from_slice(said)
        .unwrap_or_else(|_| panic!("{name}: JSON and nothing else: {}", String::from_utf8_lossy(said)));
    let file = format!("{}/docs/schema/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let schema = std::fs::read_to_string(&file).unwrap_or_else(|_| panic!("{file} is there"));
    let misfits = misfits(&serde_json::from_str(&schema).expect("JSON"), &value);
    assert!(misfits.is_empty(), "the answer of {name} beside its schema: {misfits:#?}");
    value
}

/// Where `value` does not fit `schema`; empty where it does.
fn misfits(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    check(schema, schema, value, "$", &mut found);
    found
}

fn check(root: &Value, schema: &Value, value: &Value, at: &str, found: &mut Vec<String>) {
    let words = match schema {
        Value::Bool(true) => return,
        Value::Object(words) => words,
        other => return found.push(format!("{at}: no schema: {other}")),
    };
    for (word, rule) in words.iter().filter(|(word, _)| !SILENT.contains(&word.as_str())) {
        let fits = match word.as_str() {
            "$ref" => {
                let pointer =
                    rule.as_str().and_then(|it| it.strip_prefix('#')).expect("a reference into itself");
                check(root, root.pointer(pointer).expect("it is there"), value, at, found);
                true
            }
            "type" => kinds(rule).any(|kind| is(value, kind)),
            "const" => value == rule,
            "enum" => rule.as_array().is_some_and(|allowed| allowed.contains(value)),
            "minimum" => value.as_f64().zip(rule.as_f64()).is_none_or(|(value, least)| value >= least),
            "maximum" => value.as_f64().zip(rule.as_f64()).is_none_or(|(value, most)| value <= most),
            "minLength" => {
                value.as_str().is_none_or(|text| text.chars().count() as u64 >= rule.as_u64().unwrap_or(0))
            }
            "maxLength" => {
                value.as_str().is_none_or(|text| text.chars().count() as u64 <= rule.as_u64().unwrap_or(0))
            }
            "minItems" => {
                value.as_array().is_none_or(|items| items.len() as u64 >= rule.as_u64().unwrap_or(0))
            }
            "maxItems" => {
                value.as_array().is_none_or(|items| items.len() as u64 <= rule.as_u64().unwrap_or(0))
            }
            "required" => value.as_object().is_none_or(|fields| {
                rule.as_array()
                    .into_iter()
                    .flatten()
                    .filter_map(Value::as_str)
                    .all(|name| fields.contains_key(name))
            }),
            "anyOf" | "oneOf" => alternatives(rule).any(|one| fits_one(root, one, value)),
            "allOf" => alternatives(rule).all(|one| fits_one(root, one, value)),
            "properties" | "additionalProperties" | "unevaluatedProperties" => {
                fields(root, words, word, value, at, found);
                true
            }
            "items" => {
                let first = words.get("prefixItems").and_then(Value::as_array).map_or(0, Vec::len);
                for (index, item) in value.as_array().into_iter().flatten().enumerate().skip(first) {
                    check(root, rule, item, &format!("{at}[{index}]"), found);
                }
                true
            }
            "prefixItems" => {
                for (index, (one, item)) in
                    alternatives(rule).zip(value.as_array().into_iter().flatten()).enumerate()
                {
                    check(root, one, item, &format!("{at}[{index}]"), found);
                }
                true
            }
            other => panic!("{at}: the checker does not know `{other}`"),
        };
        if !fits {
            found.push(format!("{at}: `{word}` {rule} does not fit {value}"));
        }
    }
}

fn fits_one(root: &Value, schema: &Value, value: &Value) -> bool {
    let mut found = Vec::new();
    check(root, schema, value, "", &mut found);
    found.is_empty()
}

fn alternatives(rule: &Value) -> impl Iterator<Item = &Value> {
    rule.as_array().into_iter().flatten()
}

fn kinds(rule: &Value) -> impl Iterator<Item = &str> {
    rule.as_str().into_iter().chain(alternatives(rule).filter_map(Value::as_str))
}

fn is(value: &Value, kind: &str) -> bool {
    match kind {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        _ => false,
    }
}

fn fields(
    root: &Value,
    words: &Map<String, Value>,
    word: &str,
    value: &Value,
    at: &str,
    found: &mut Vec<String>,
) {
    let named = words.get("properties").and_then(Value::as_object);
    for (name, field) in value.as_object().into_iter().flatten() {
        let own = named.and_then(|named| named.get(name));
        let rule = if word == "properties" { own } else { words.get(word).filter(|_| own.is_none()) };
        match rule {
            Some(Value::Bool(false)) => found.push(format!("{at}: no field `{name}` is known")),
            Some(rule) => check(root, rule, field, &format!("{at}.{name}"), found),
            None => {}
        }
    }
}

#[test]
fn the_checker_sees_what_does_not_fit() {
    let schema = serde_json::json!({
        "type": "object",
        "properties": { "a": { "type": ["number", "null"] }, "b": { "$ref": "#/$defs/B" }, "c": { "const": 2 } },
        "required": ["a", "c"],
        "$defs": { "B": { "type": "array", "items": { "enum": ["x", "y"] }, "maxItems": 2 } },
    });
    let count = |text: &str| misfits(&schema, &serde_json::from_str(text).expect("JSON")).len();
    assert_eq!(count(r#"{"a": 1.5, "b": ["x", "y"], "c": 2, "new": 1}"#), 0);
    assert_eq!(count(r#"{"a": null, "c": 2}"#), 0);
    assert_eq!(count(r#"{"a": "1", "c": 2}"#), 1);
    assert_eq!(count(r#"{"a": 1, "b": ["x", "z"], "c": 3}"#), 2);
    assert_eq!(count(r#"{"b": ["x", "x", "x"]}"#), 2);
}
