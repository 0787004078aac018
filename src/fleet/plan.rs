//! The list of benches: a TOML file, written by hand or made of folders.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::FleetError;
use crate::file::{read_settings_text, toml_error};
use crate::log::formats::ENDINGS;
use crate::session::{self, Job};

/// Benches to diagnose.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// One for each `[[bench]]`, in the order of the file.
    #[serde(default, rename = "bench")]
    pub benches: Vec<FleetBench>,
}

/// One bench.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FleetBench {
    /// Name: letters, digits, `.`, `_` and `-`; no other bench of the plan has it.
    pub name: String,
    /// Model file, or `paper`.
    #[serde(default = "paper")]
    pub model: PathBuf,
    /// Logs to fit on.
    pub log: Vec<PathBuf>,
    /// Validation logs; without them every third stretch of the training logs is held out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validate: Vec<PathBuf>,
    /// Mapping of foreign logs: a file, or the name of a shipped one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mapping: Option<String>,
    /// Rotors, from 1; empty = all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rotors: Vec<usize>,
    /// [s] windows over which the body runs freely.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub horizon_s: Option<f64>,
}

fn paper() -> PathBuf {
    "paper".into()
}

impl Plan {
    /// Reads a plan. Files that it names are meant from its own folder.
    ///
    /// # Errors
    /// [`FleetError::File`], and [`FleetError::Plan`] with the line of what is wrong.
    pub fn load(path: &Path) -> Result<Self, FleetError> {
        let text = read_settings_text(path).map_err(FleetError::file(path))?;
        let wrong = |reason| FleetError::Plan { path: path.to_owned(), reason };
        let mut plan: Self = toml::from_str(&text).map_err(|error| wrong(toml_error(&text, &error)))?;
        plan.check().map_err(wrong)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        plan.benches.iter_mut().for_each(|bench| bench.be_from(folder));
        Ok(plan)
    }

    /// A plan of folders, one for each bench: `patterns` are folders, or have `*` for any name in their last part. In each,
    /// `model.toml` is its model, files with `valid`, `held` or `test` in their names are held out, all other logs are fitted
    /// on. Sorted by name.
    ///
    /// # Errors
    /// [`FleetError::NoBench`] of a pattern without a folder that holds logs; [`FleetError::File`].
    pub fn of_folders(patterns: &[String]) -> Result<Self, FleetError> {
        let mut plan = Self::default();
        for pattern in patterns {
            let mut found = false;
            for folder in folders(pattern)? {
                if let Some(bench) = bench_in(&folder)? {
                    plan.benches.push(bench);
                    found = true;
                }
            }
            if !found {
                return Err(FleetError::NoBench { pattern: pattern.clone() });
            }
        }
        plan.benches.sort_by(|a, b| a.name.cmp(&b.name));
        plan.check().map_err(|reason| FleetError::Plan { path: patterns.join(" ").into(), reason })?;
        Ok(plan)
    }

    /// The first log whose columns have no meaning without a mapping; of each bench one is looked at.
    #[must_use]
    pub fn foreign_log(&self, job: &Job) -> Option<&Path> {
        let unmapped = self.benches.iter().filter(|bench| bench.mapping.is_none());
        let mut logs = unmapped.filter_map(|bench| bench.log.first()).map(PathBuf::as_path);
        // What cannot be read is said by the run.
        logs.find(|log| matches!(session::guess_columns(log, job), Ok(Some(_))))
    }

    /// What makes it no plan.
    fn check(&self) -> Result<(), String> {
        if self.benches.is_empty() {
            return Err("no [[bench]]".to_owned());
        }
        let mut names = BTreeSet::new();
        for (at, bench) in self.benches.iter().enumerate() {
            let (number, name) = (at + 1, &bench.name);
            if !is_name(name) {
                return Err(format!(
                    "[[bench]] {number}: the name may have 1 to 100 letters, digits, `.`, `_` and `-`, and begins with none of these three"
                ));
            }
            if !names.insert(name) {
                return Err(format!("[[bench]] {number}: another bench is called {name}, too"));
            }
            if bench.log.is_empty() {
                return Err(format!("bench {name}: no log"));
            }
            if bench.rotors.contains(&0) {
                return Err(format!("bench {name}: rotors are counted from 1"));
            }
            if bench.horizon_s.is_some_and(|horizon| !(horizon.is_finite() && horizon > 0.0)) {
                return Err(format!("bench {name}: horizon_s has to be greater than 0"));
            }
        }
        Ok(())
    }
}

impl FleetBench {
    /// Its files as named from `folder`.
    fn be_from(&mut self, folder: &Path) {
        let of = |path: &mut PathBuf| *path = folder.join(&*path);
        self.log.iter_mut().chain(&mut self.validate).for_each(of);
        if self.model != paper() {
            of(&mut self.model);
        }
        // A mapping may be the name of a shipped one: then no file is there.
        if let Some(mapping) = self.mapping.as_mut() {
            let file = folder.join(&*mapping);
            if file.is_file() {
                *mapping = file.to_string_lossy().into_owned();
            }
        }
    }
}

fn is_name(name: &str) -> bool {
    let letter = |it: char| it.is_ascii_alphanumeric() || "._-".contains(it);
    (1..=100).contains(&name.len())
        && name.chars().all(letter)
        && name.starts_with(|it: char| it.is_ascii_alphanumeric())
}

/// The folders that a pattern means, sorted.
fn folders(pattern: &str) -> Result<Vec<PathBuf>, FleetError> {
    let path = Path::new(pattern.trim_end_matches('/'));
    let last = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    if !last.contains('*') {
        return Ok(vec![path.to_owned()]);
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let parts: Vec<&str> = last.split('*').collect();
    let mut found = Vec::new();
    for entry in fs::read_dir(parent).map_err(FleetError::file(parent))? {
        let entry = entry.map_err(FleetError::file(parent))?;
        if entry.path().is_dir() && fits(&entry.file_name().to_string_lossy(), &parts) {
            found.push(entry.path());
        }
    }
    found.sort();
    Ok(found)
}

/// Whether a name is the parts in their order, with anything between them.
fn fits(name: &str, parts: &[&str]) -> bool {
    let [first, middle @ .., last] = parts else { return false };
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    for part in middle {
        match rest.split_once(part) {
            Some((_, behind)) => rest = behind,
            None => return false,
        }
    }
    rest.ends_with(last)
}

/// The bench that a folder holds; `None` without a log.
fn bench_in(folder: &Path) -> Result<Option<FleetBench>, FleetError> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(FleetError::file(folder))? {
        files.push(entry.map_err(FleetError::file(folder))?.path());
    }
    files.sort();
    let is_log = |path: &PathBuf| {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        path.is_file() && ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
    };
    let is_held_out = |path: &PathBuf| {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().to_lowercase()).unwrap_or_default();
        ["valid", "held", "test"].iter().any(|word| stem.contains(word))
    };
    let (validate, log): (Vec<PathBuf>, Vec<PathBuf>) =
        files.into_iter().filter(is_log).partition(is_held_out);
    // A folder with held-out logs alone is fitted on them.
    let (log, validate) = if log.is_empty() { (validate, log) } else { (log, validate) };
    let model = folder.join("model.toml");
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let model = if model.is_file() { model } else { paper() };
    Ok((!log.is_empty()).then(|| FleetBench { name, model, log, validate, ..FleetBench::default() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("plan.toml");
        fs::write(&path, text).expect("written");
        let said = Plan::load(&path).expect_err("it is none").to_string();
        said.trim_start_matches(&format!("{}: ", path.display())).to_owned()
    }

    #[test]
    fn a_plan_that_is_none_is_refused_with_its_place() {
        assert_eq!(refusal(""), "no [[bench]]");
        assert!(
            refusal("[[bench]]\nname = \"a\"\nlog = [\"a.csv\"]\nmodle = \"m\"\n")
                .contains("line 4, column 1")
        );
        assert!(
            refusal("[[bench]]\nname = \"../a\"\nlog = [\"a.csv\"]\n").starts_with("[[bench]] 1: the name")
        );
        let twice = "[[bench]]\nname = \"a\"\nlog = [\"a.csv\"]\n".repeat(2);
        assert_eq!(refusal(&twice), "[[bench]] 2: another bench is called a, too");
        assert_eq!(refusal("[[bench]]\nname = \"a\"\nlog = []\n"), "bench a: no log");
    }

    #[test]
    fn files_are_meant_from_the_folder_of_the_plan() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("plan.toml");
        let text = "[[bench]]\nname = \"a\"\nlog = [\"x/a.csv\"]\nmapping = \"rcbenchmark\"\n";
        fs::write(&path, text).expect("written");
        let plan = Plan::load(&path).expect("a plan");
        assert_eq!(plan.benches[0].log, [folder.path().join("x/a.csv")]);
        assert_eq!(plan.benches[0].model, PathBuf::from("paper"));
        assert_eq!(plan.benches[0].mapping.as_deref(), Some("rcbenchmark"));
    }

    #[test]
    fn folders_become_benches() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, files) in [
            ("bench-2", &["train.csv", "validate.csv", "model.toml", "notes.md"][..]),
            ("bench-1", &["a.csv", "b.csv"]),
            ("other", &["a.csv"]),
            ("bench-3", &["notes.md"]),
        ] {
            let bench = folder.path().join(name);
            fs::create_dir(&bench).expect("made");
            files.iter().for_each(|file| fs::write(bench.join(file), "").expect("written"));
        }
        let pattern = format!("{}/bench-*/", folder.path().display());
        let plan = Plan::of_folders(&[pattern]).expect("a plan");
        let names: Vec<&str> = plan.benches.iter().map(|bench| bench.name.as_str()).collect();
        assert_eq!(names, ["bench-1", "bench-2"]);
        let [one, two] = &plan.benches[..] else { panic!("two benches") };
        assert_eq!((one.log.len(), one.validate.len(), &one.model), (2, 0, &paper()));
        assert_eq!(two.log, [folder.path().join("bench-2/train.csv")]);
        assert_eq!(two.validate, [folder.path().join("bench-2/validate.csv")]);
        assert_eq!(two.model, folder.path().join("bench-2/model.toml"));
        let none = format!("{}/nothing-*", folder.path().display());
        assert!(matches!(Plan::of_folders(&[none]), Err(FleetError::NoBench { .. })));
    }

    #[test]
    fn a_star_stands_for_anything() {
        let fits = |name, pattern: &str| super::fits(name, &pattern.split('*').collect::<Vec<_>>());
        assert!(fits("bench-12-a", "bench-*-a") && fits("bench-a", "*") && fits("aa", "a*a"));
        assert!(!fits("a", "a*a") && !fits("bench-12", "bench-*-a") && !fits("xbench", "bench*"));
    }
}
