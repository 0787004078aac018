//! The schemas, made from the types of the answers.

use std::fs;
use std::path::Path;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde::Serialize;
use serde_json::{Value, json};

use super::super::{effects, experiment, export, extend, import, monitor, record, replay};
use super::SCHEMAS;
use crate::compare::Comparison;
use crate::diagnose::{Diagnosis, RotorDiagnoses};
use crate::discover::Discovery;
use crate::emulate::BusSummary;
use crate::fleet::Fleet;
use crate::identify::Identification;
use crate::report::{check, design, doctor};
use crate::runtime::bridge::BridgeSummary;
use crate::runtime::control::ControlSummary;
use crate::runtime::emulate::GuardedSummary;
use crate::runtime::lockstep::run::LockstepSummary;
use crate::runtime::lockstep::two_process::AnswerSummary;
use crate::runtime::run::RunSummary;
use crate::session::GuessedLog;
use crate::studies::controller_comparison::RunComparison;
use crate::studies::jitter::Jitter;
use crate::studies::paper::PaperRun;

/// What `report::json` adds to the answers about logs.
#[derive(Serialize, JsonSchema)]
struct WithSentences<T> {
    #[serde(flatten)]
    answer: T,
    /// The findings as sentences, in their order.
    warnings: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct Comparisons {
    /// One for each model and log.
    comparisons: Vec<WithSentences<Comparison>>,
}

/// The schema of the answer of `command`: a number that does not exist is `null`, and each answer says its version.
fn schema<T: JsonSchema>(command: &str) -> Value {
    let nullable = RecursiveTransform(|schema: &mut schemars::Schema| {
        if schema.get("type") == Some(&json!("number")) {
            schema.insert("type".to_owned(), json!(["number", "null"]));
        }
        schema.remove("format");
    });
    let settings = SchemaSettings::draft2020_12().for_serialize().with_transform(nullable);
    let mut root = settings.into_generator().into_root_schema_for::<T>().to_value();
    root["title"] = json!(format!("rotorbench {command} --json"));
    // Of a list each of its objects says it.
    let row =
        root.pointer("/items/$ref").and_then(Value::as_str).map(|it| it.trim_start_matches('#').to_owned());
    let answer = match row {
        Some(row) => root.pointer_mut(&row).expect("what the list holds"),
        None => &mut root,
    };
    if let Some(fields) = answer.get_mut("properties").and_then(Value::as_object_mut) {
        let version = json!({ "const": crate::report::json::SCHEMA, "description": "Version of the form." });
        fields.insert("schema".to_owned(), version);
        // Not there yet where no field is always there.
        if answer.get("required").is_none() {
            answer["required"] = json!([]);
        }
        answer["required"].as_array_mut().expect("a list").push(json!("schema"));
    }
    root
}

/// A field that `report::json` writes into the definition of a type.
fn add(root: &mut Value, definition: &str, field: &str, rule: &Value) {
    let there = &mut root["$defs"][definition];
    assert!(there["properties"].is_object(), "{definition} is another type");
    there["properties"][field] = rule.clone();
    there["required"].as_array_mut().expect("a list").push(json!(field));
}

/// What an identification says beside its fields.
fn add_outcomes(root: &mut Value) {
    let meaning = "What was done, or why it was not, as a sentence.";
    add(root, "PipelineStep", "outcome", &json!({ "type": "string", "description": meaning }));
    let meaning = "The step and its equation.";
    add(root, "PipelineStep", "step", &json!({ "type": "string", "description": meaning }));
}

fn of(name: &str) -> Value {
    match name {
        "bridge" => schema::<BridgeSummary>(name),
        "check" => schema::<check::CheckAnswer>(name),
        "compare" => {
            let mut root = schema::<Comparisons>(name);
            let meaning = "How it was run, in words.";
            add(&mut root, "ScoredBlock", "run", &json!({ "type": "string", "description": meaning }));
            root
        }
        "compare-runs" => schema::<WithSentences<RunComparison>>("compare --runs"),
        "control" => schema::<ControlSummary>(name),
        "control-lockstep" => schema::<AnswerSummary>("control --lockstep"),
        "design" => schema::<design::Design>(name),
        "diagnose" => {
            let mut root = schema::<WithSentences<Diagnosis>>(name);
            let meaning = "The refusal as a sentence; empty without one.";
            let rule = json!({ "type": "string", "description": meaning });
            add(&mut root, "RankedCandidate", "note", &rule);
            root
        }
        "diagnose-rotors" => {
            let mut root = schema::<RotorDiagnoses>("diagnose of more than two rotors");
            let meaning = "The refusal as a sentence; empty without one.";
            add(&mut root, "RankedCandidate", "note", &json!({ "type": "string", "description": meaning }));
            let meaning = "The findings as sentences, in their order.";
            let rule = json!({ "type": "array", "items": { "type": "string" }, "description": meaning });
            add(&mut root, "RotorDiagnosis", "warnings", &rule);
            root
        }
        "discover" => schema::<WithSentences<Discovery>>(name),
        "doctor" => schema::<Vec<doctor::DoctorRow>>(name),
        "effects" => schema::<Vec<effects::EffectAnswer>>(name),
        "effects-card" => schema::<effects::EffectAnswer>("effects ID"),
        "emulate-can" => schema::<BusSummary>("emulate --can INTERFACE"),
        "emulate-lockstep" => schema::<LockstepSummary>("emulate --shm --lockstep"),
        "emulate-shm" => schema::<GuardedSummary>("emulate --shm"),
        "experiment" => schema::<experiment::ExperimentFile>(name),
        "export" => schema::<export::ExportAnswer>(name),
        "extend" => schema::<extend::ExtendAnswer>(name),
        "extend-step-back" => schema::<extend::Undone>("extend --step-back"),
        "fleet-merge" => schema::<WithSentences<Fleet>>("fleet merge"),
        "identify" => {
            let mut root = schema::<WithSentences<Identification>>(name);
            add_outcomes(&mut root);
            root
        }
        "import" => schema::<import::ImportAnswer>(name),
        "import-guess" => schema::<GuessedLog>("import of a foreign log"),
        "jitter" => {
            let mut root = schema::<Jitter>(name);
            let meaning = "Why it was not measured, as a sentence.";
            let rule = json!({ "type": ["string", "null"], "description": meaning });
            ["StageResult", "CyclictestResult"]
                .iter()
                .for_each(|it| add(&mut root, it, "not_measured", &rule));
            root
        }
        "monitor" => schema::<monitor::MonitorLine>(name),
        "paper" => {
            let mut root = schema::<PaperRun>(name);
            add_outcomes(&mut root);
            let meaning = "The findings as sentences, in their order.";
            let rule = json!({ "type": "array", "items": { "type": "string" }, "description": meaning });
            add(&mut root, "Identification", "warnings", &rule);
            root
        }
        "record" => schema::<record::RecordAnswer>(name),
        "replay" => schema::<replay::ReplayAnswer>(name),
        "run" => schema::<RunSummary>(name),
        "run-lockstep" => schema::<LockstepSummary>("run --lockstep"),
        _ => panic!("{name} has no type"),
    }
}

#[test]
fn the_files_are_those_of_the_types() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema");
    let bless = std::env::var_os("ROTORBENCH_BLESS").is_some();
    for (name, shipped) in SCHEMAS {
        let text = serde_json::to_string_pretty(&of(name)).expect("JSON") + "\n";
        if bless && text != shipped {
            fs::write(folder.join(format!("{name}.json")), text).expect("written");
        } else {
            assert!(text == shipped, "{name}: ROTORBENCH_BLESS=1 cargo test --lib schema:: writes it anew");
        }
    }
}

/// One named like the command, or like it with what sets an answer of its own behind it.
#[test]
fn each_command_that_answers_in_json_has_a_schema() {
    let command = super::super::command();
    let answers = |it: &&clap::Command| it.get_arguments().any(|argument| argument.get_id() == "json");
    let names: Vec<&str> = command.get_subcommands().filter(answers).map(clap::Command::get_name).collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        let is_of = |schema: &str| {
            schema.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        };
        assert!(
            SCHEMAS.iter().any(|(schema, _)| is_of(schema)),
            "the answer of `{name} --json` has no schema"
        );
    }
}
