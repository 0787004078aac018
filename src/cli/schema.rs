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
const SCHEMAS: [(&str, &str); 31] = schemas![
    "bridge",
    "check",
    "compare",
    "compare-runs",
    "control",
    "control-lockstep",
    "design",
    "diagnose",
    "diagnose-rotors",
    "discover",
    "doctor",
    "effects",
    "effects-card",
    "emulate-can",
    "emulate-lockstep",
    "emulate-shm",
    "experiment",
    "export",
    "extend",
    "extend-step-back",
    "fleet-merge",
    "identify",
    "import",
    "import-guess",
    "jitter",
    "monitor",
    "paper",
    "record",
    "replay",
    "run",
    "run-lockstep",
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
mod tests;
