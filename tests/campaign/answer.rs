//! What `diagnose --json` answered, read as a stranger reads it: by the contract alone.

use std::error::Error;
use std::path::Path;
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use std::{fs, io};

use serde_json::{Map, Value};

/// One answer, or why there is none.
pub struct Answer {
    pub json: Result<Value, String>,
    pub seconds: f64,
    /// Where the program made the model first.
    pub identified: Option<Identified>,
}

/// What `identify` took into a model.
pub struct Identified {
    pub effects: Vec<String>,
    /// [-] highest power of its curve.
    pub degree: usize,
    /// Whether it has a voltage gain: in some logs the battery's fall does not show beside what else is missing.
    pub has_voltage_gain: bool,
}

impl Identified {
    fn read(model: &Path) -> Option<Self> {
        let model: toml::Table = fs::read_to_string(model).ok()?.parse().ok()?;
        let of = |effect: &toml::Value| Some(effect.get("id")?.as_str()?.to_owned());
        let effects = model.get("effects").and_then(toml::Value::as_array);
        let actuator = model.get("actuator")?;
        let curve = actuator.get("steady_rate")?.as_array()?;
        Some(Self {
            effects: effects.into_iter().flatten().filter_map(of).collect(),
            degree: curve.len().saturating_sub(1),
            has_voltage_gain: actuator
                .get("voltage_gain")
                .and_then(toml::Value::as_float)
                .is_some_and(|gain| gain != 0.0),
        })
    }
}

/// Asks about every case of a folder that `counts`, on so many threads; what `judge` makes of the answers, in the cases' order.
pub fn ask_all<T: Send>(
    (folder, program, jobs): (&Path, &Path, usize),
    command: &str,
    counts: impl Fn(&Value) -> bool,
    judge: impl Fn(&str, &Value, &Answer) -> Option<T> + Sync,
) -> Result<Vec<T>, Box<dyn Error>> {
    let program = fs::canonicalize(program).map_err(|error| format!("{}: {error}", program.display()))?;
    let path = folder.join("truth.json");
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let truths: Map<String, Value> = serde_json::from_str(&text)?;
    let asked: Vec<(&String, &Value)> = truths.iter().filter(|(_, truth)| counts(truth)).collect();
    let (next, all) = (AtomicUsize::new(0), Mutex::new(Vec::<(usize, T)>::new()));
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some((number, (name, truth))) = {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    asked.get(at).map(|case| (at, *case))
                } {
                    let answer = ask(&program, &folder.join(name), command).unwrap_or_else(|error| Answer {
                        json: Err(error.to_string()),
                        seconds: 0.0,
                        identified: None,
                    });
                    let Some(one) = judge(name, truth, &answer) else { continue };
                    if let Ok(mut all) = all.lock() {
                        all.push((number, one));
                    }
                }
            });
        }
    });
    let mut all = all.into_inner().map_err(|_| "a judge gave up")?;
    all.sort_by_key(|(number, _)| *number);
    Ok(all.into_iter().map(|(_, one)| one).collect())
}

/// What lies in a folder whose bench nobody has a model of: `identify` makes one from the log first.
pub const WITHOUT_MODEL: &str = "without-model";

/// Asks the program about the logs in `folder`. The logs are copied under names that say nothing, away from
/// the truth. The paper's model is asked about, the folder's own, or the one that is made first; `command` is `diagnose` or `discover`.
pub fn ask(program: &Path, folder: &Path, command: &str) -> io::Result<Answer> {
    let away = tempfile::tempdir()?;
    for (from, to) in [("train.csv", "a.csv"), ("validate.csv", "b.csv")] {
        fs::copy(folder.join(from), away.path().join(to))?;
    }
    let own = folder.join("model.toml");
    if own.exists() {
        fs::copy(own, away.path().join("model.toml"))?;
    }
    let is_to_identify = folder.join(WITHOUT_MODEL).exists();
    if is_to_identify {
        let identified = Command::new(program)
            .args(["identify", "--log", "a.csv", "-o", "model.toml"])
            .current_dir(away.path())
            .output()?;
        if !identified.status.success() {
            let said =
                String::from_utf8_lossy(&identified.stderr).lines().last().unwrap_or_default().to_owned();
            return Ok(Answer {
                json: Err(format!("identify: {}; {said}", identified.status)),
                seconds: 0.0,
                identified: None,
            });
        }
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
    let identified = is_to_identify.then(|| Identified::read(&away.path().join("model.toml"))).flatten();
    Ok(Answer { json, seconds, identified })
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
