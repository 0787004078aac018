//! A folder to work in, the program in it, and what it says.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

pub struct Desk {
    folder: TempDir,
}

impl Desk {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder") }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("written");
        path
    }

    /// A log of a closed-loop run of the emulator.
    pub fn record(&self, name: &str, sequence: u32, more: &[&str]) -> PathBuf {
        let log = self.path(name);
        let (path, sequence) = (log.display().to_string(), sequence.to_string());
        let mut arguments = vec!["experiment", "prbs", "--lockstep", "--closed-loop", "--amplitude", "0.03"];
        arguments.extend(["--duration", "20", "--seed", &sequence, "--sequence", &sequence, "-o", &path]);
        arguments.extend(more);
        let output = run(&arguments);
        assert!(output.status.success(), "{}", said(&output));
        log
    }

    /// The columns of a log that `keeps` wants, up to `until` [s], their values through `change`.
    pub fn changed(
        &self,
        log: &Path,
        name: &str,
        until: f64,
        keeps: impl Fn(&str) -> bool,
        change: impl Fn(&str, f64) -> f64,
    ) -> PathBuf {
        let text = fs::read_to_string(log).expect("a log");
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().expect("a header").split(',').collect();
        let kept = |line: &str, cell: &dyn Fn(&str, &str) -> String| -> String {
            let cells = names.iter().zip(line.split(',')).filter(|(name, _)| keeps(name));
            cells.map(|(name, value)| cell(name, value)).collect::<Vec<_>>().join(",") + "\n"
        };
        let mut out = kept(&names.join(","), &|_, value| value.to_owned());
        let value = |name: &str, value: &str| {
            value.parse().map_or_else(|_| value.to_owned(), |value| change(name, value).to_string())
        };
        let early =
            |line: &&str| line.split(',').next().and_then(|t| t.parse().ok()).is_some_and(|t: f64| t < until);
        lines.filter(early).for_each(|line| out.push_str(&kept(line, &value)));
        self.write(name, &out)
    }
}

pub fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rotorbench")).args(arguments).output().expect("the program runs")
}

pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub fn diagnose(model: &str, log: &Path, validate: &Path) -> (Value, Option<i32>) {
    diagnose_all(model, &[log], validate)
}

/// The same of several logs.
pub fn diagnose_all(model: &str, logs: &[&Path], validate: &Path) -> (Value, Option<i32>) {
    let text = |path: &Path| path.display().to_string();
    let (logs, validate): (Vec<String>, String) =
        (logs.iter().map(|log| text(log)).collect(), text(validate));
    let mut arguments = vec!["diagnose", "--model", model, "--validate", &validate, "--json", "--log"];
    arguments.extend(logs.iter().map(String::as_str));
    let output = run(&arguments);
    let answer = serde_json::from_slice(&output.stdout);
    (answer.unwrap_or_else(|error| panic!("{error}: {}", said(&output))), output.status.code())
}

pub fn refused(arguments: &[&str], parts: &[&str]) {
    let output = run(arguments);
    let sentence = said(&output);
    assert_eq!(output.status.code(), Some(2), "{sentence}");
    assert!(output.stdout.is_empty(), "an answer beside the refusal");
    for part in parts {
        assert!(sentence.contains(part), "`{part}` is not in: {sentence}");
    }
    assert!(!sentence.contains("panicked"), "{sentence}");
}

pub fn number(value: &Value, path: &[&str]) -> f64 {
    let found = path.iter().fold(value, |value, key| &value[*key]);
    found.as_f64().unwrap_or_else(|| panic!("no number at {path:?} in {value}"))
}

/// The finding of an answer with this code; null where there is none.
pub fn finding<'a>(answer: &'a Value, code: &str) -> &'a Value {
    let mut findings = answer["findings"].as_array().into_iter().flatten();
    findings.find(|finding| finding["code"] == code).unwrap_or(&Value::Null)
}

/// Whether an answer has a finding with this code.
pub fn has_code(answer: &Value, code: &str) -> bool {
    !finding(answer, code).is_null()
}

pub fn said_out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}
