//! What `diagnose --json` answered, read as a stranger reads it: by the contract alone.

use std::path::Path;
use std::process::Command;
use std::time::Instant;
use std::{fs, io};

use serde_json::Value;

/// One answer, or why there is none.
pub struct Answer {
    pub json: Result<Value, String>,
    pub seconds: f64,
}

/// Asks the program about the logs in `folder`. The logs are copied under names that say nothing, away from
/// the truth. The paper's model is asked about, or the folder's own; `command` is `diagnose` or `discover`.
pub fn ask(program: &Path, folder: &Path, command: &str) -> io::Result<Answer> {
    let away = tempfile::tempdir()?;
    for (from, to) in [("train.csv", "a.csv"), ("validate.csv", "b.csv")] {
        fs::copy(folder.join(from), away.path().join(to))?;
    }
    let own = folder.join("model.toml");
    if own.exists() {
        fs::copy(own, away.path().join("model.toml"))?;
    }
    let model = if away.path().join("model.toml").exists() { "model.toml" } else { "paper" };
    let started = Instant::now();
    let output = Command::new(program)
        .args([command, "--json", "--model", model, "--log", "a.csv", "--validate", "b.csv"])
        .current_dir(away.path())
        .output()?;
    let seconds = started.elapsed().as_secs_f64();
    let json = match serde_json::from_slice(&output.stdout) {
        Ok(value) if command != "diagnose" => Ok(value),
        Ok(value) => check(&value).map(|()| value),
        Err(error) => Err(format!(
            "{error}; {} {}",
            output.status,
            String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default()
        )),
    };
    Ok(Answer { json, seconds })
}

const VERDICTS: [&str; 5] =
    ["missing_effect", "adequate", "parameters_changed", "unknown", "insufficient_data"];

/// The contract's shape, and that the answer does not contradict itself.
fn check(answer: &Value) -> Result<(), String> {
    let verdict = answer["verdict"].as_str().ok_or("no verdict")?;
    if !VERDICTS.contains(&verdict) {
        return Err(format!("verdict `{verdict}`"));
    }
    let effects = answer["effects"].as_array().ok_or("no list `effects`")?;
    // `unknown` may name what explains a part.
    if verdict != "unknown" && (verdict == "missing_effect") == effects.is_empty() {
        return Err(format!("verdict `{verdict}` with {} effects", effects.len()));
    }
    if verdict == "parameters_changed" && answer["changed_parameters"].as_array().is_none_or(Vec::is_empty) {
        return Err("parameters changed, and none named".to_owned());
    }
    for (step, part) in
        [("base", "train"), ("base", "validate"), ("extended", "train"), ("extended", "validate")]
    {
        if verdict != "insufficient_data" && answer["error"][step][part].as_f64().is_none() {
            return Err(format!("no error.{step}.{part}"));
        }
    }
    Ok(())
}

/// The set of effects a list of names holds, in one order.
pub fn set_of(list: &Value) -> Vec<String> {
    let names = list.as_array().into_iter().flatten().filter_map(|name| name.as_str().map(str::to_owned));
    let mut set: Vec<String> = names.collect();
    set.sort();
    set
}
