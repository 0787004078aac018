//! `rotorbench schema`: the JSON Schema of a `--json` answer. The files in `docs/schema/` are made from the types of the answers by
//! the test below, which holds them current.

use super::{CliResult, Outcome};

/// Arguments of `schema`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Whose answer; without one, the names that there are
    #[arg(value_name = "COMMAND", value_parser = clap::builder::PossibleValuesParser::new(SCHEMAS.map(|(name, _)| name)))]
    answer: Option<String>,
}

macro_rules! schemas {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../../docs/schema/", $name, ".json")))),*]
    };
}

/// The schemas by the name of the command, with what sets an answer of its own behind it.
const SCHEMAS: [(&str, &str); 12] = schemas![
    "check",
    "compare",
    "compare-runs",
    "design",
    "diagnose",
    "effects",
    "effects-card",
    "extend",
    "extend-step-back",
    "identify",
    "import",
    "import-guess",
];

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    match &arguments.answer {
        Some(answer) => {
            SCHEMAS.iter().filter(|(name, _)| name == answer).for_each(|(_, text)| print!("{text}"))
        }
        None => SCHEMAS.iter().for_each(|(name, _)| println!("{name}")),
    }
    Ok(Outcome::Done)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use schemars::JsonSchema;
    use schemars::generate::SchemaSettings;
    use schemars::transform::RecursiveTransform;
    use serde::Serialize;
    use serde_json::{Value, json};

    use super::super::{effects, extend, import};
    use super::SCHEMAS;
    use crate::compare::Comparison;
    use crate::diagnose::Diagnosis;
    use crate::identify::Identification;
    use crate::report::check;
    use crate::report::design;
    use crate::session::GuessedLog;
    use crate::studies::controller_comparison::RunComparison;

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

    /// The schema of `T`: a number that does not exist is `null`, and each answer says its version.
    fn schema<T: JsonSchema>(name: &str) -> Value {
        let nullable = RecursiveTransform(|schema: &mut schemars::Schema| {
            if schema.get("type") == Some(&json!("number")) {
                schema.insert("type".to_owned(), json!(["number", "null"]));
            }
            schema.remove("format");
        });
        let settings = SchemaSettings::draft2020_12().for_serialize().with_transform(nullable);
        let mut root = settings.into_generator().into_root_schema_for::<T>().to_value();
        root["title"] = json!(format!("rotorbench {} --json", name.replace("extend-step", "extend --step")));
        if let Some(fields) = root.get_mut("properties").and_then(Value::as_object_mut) {
            let version =
                json!({ "const": crate::report::json::SCHEMA, "description": "Version of the form." });
            fields.insert("schema".to_owned(), version);
            root["required"].as_array_mut().expect("a list").push(json!("schema"));
        }
        root
    }

    /// A field that `report::json` writes into the definition of a type.
    fn add(root: &mut Value, definition: &str, field: &str, meaning: &str) {
        let there = &mut root["$defs"][definition];
        assert!(there["properties"].is_object(), "{definition} is another type");
        there["properties"][field] = json!({ "type": "string", "description": meaning });
        there["required"].as_array_mut().expect("a list").push(json!(field));
    }

    fn of(name: &str) -> Value {
        match name {
            "check" => schema::<check::Answer>(name),
            "compare" => schema::<Comparisons>(name),
            "compare-runs" => schema::<WithSentences<RunComparison>>("compare --runs"),
            "design" => schema::<design::Design>(name),
            "diagnose" => {
                let mut root = schema::<WithSentences<Diagnosis>>(name);
                add(&mut root, "RankedCandidate", "note", "The refusal as a sentence; empty without one.");
                root
            }
            "effects" => schema::<Vec<effects::Answer>>(name),
            "effects-card" => schema::<effects::Answer>("effects ID"),
            "extend" => schema::<extend::Answer>(name),
            "extend-step-back" => schema::<extend::Undone>(name),
            "identify" => {
                let mut root = schema::<WithSentences<Identification>>(name);
                add(&mut root, "Part", "outcome", "What was done, or why it was not, as a sentence.");
                root
            }
            "import" => schema::<import::Report>(name),
            "import-guess" => schema::<GuessedLog>("import of a foreign log"),
            _ => panic!("{name} has no type"),
        }
    }

    #[test]
    fn the_files_are_those_of_the_types() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema");
        let bless = std::env::var_os("ROTORBENCH_BLESS").is_some();
        for (name, shipped) in SCHEMAS {
            let text = serde_json::to_string_pretty(&of(name)).expect("JSON") + "\n";
            if bless {
                fs::write(folder.join(format!("{name}.json")), text).expect("written");
            } else {
                assert!(
                    text == shipped,
                    "{name}: ROTORBENCH_BLESS=1 cargo test --lib schema:: writes it anew"
                );
            }
        }
    }
}
