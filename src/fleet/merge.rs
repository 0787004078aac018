//! Answers in a folder, put together.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::run::UNREADABLE;
use super::{BenchAnswer, BenchRow, DiagnosisExtract, Fleet, FleetError, Plan, inputs};
use crate::screening::Finding;

/// Puts the answers in `folder` together. With `plan` only those of its benches count that are of today's inputs, and benches
/// without one are missing. In which order, and on which machines, the answers were made has no part in it.
///
/// # Errors
/// [`FleetError`] of the folder, of a file in it that is no answer, or of an input of the plan.
pub fn merge(folder: &Path, plan: Option<&Plan>) -> Result<Fleet, FleetError> {
    let mut rows = rows_in(folder)?;
    let mut missing = Vec::new();
    let mut notes = Vec::new();
    if let Some(plan) = plan {
        let wanted = wanted(plan, folder);
        let (kept, stale): (Vec<BenchRow>, Vec<BenchRow>) =
            rows.into_iter().partition(|row| wanted.get(&row.bench).is_some_and(|it| it.contains(&row.file)));
        rows = kept;
        if !stale.is_empty() {
            let files: Vec<String> = stale.iter().map(|row| row.file.clone()).collect();
            notes.push(Finding::new("answers_not_of_the_plan", "").with("files", files));
        }
        let there: BTreeSet<&str> = rows.iter().map(|row| row.bench.as_str()).collect();
        let without = plan.benches.iter().filter(|bench| !there.contains(bench.name.as_str()));
        missing.extend(without.map(|bench| bench.name.clone()));
    }
    let twice = rows.chunk_by(|a, b| a.bench == b.bench).filter(|same| same.len() > 1);
    notes.extend(
        twice.map(|same| Finding::new("answers_of_one_bench", &*same[0].bench).with("answers", same.len())),
    );
    Ok(Fleet::of(rows, missing, notes))
}

/// For each bench of a plan the names of the files that may be its answer.
fn wanted(plan: &Plan, folder: &Path) -> BTreeMap<String, Vec<String>> {
    let name =
        |path: PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let of = |bench: &super::FleetBench| {
        // Inputs that cannot be read have no hash, and the answer says so.
        let sum = inputs::hash(bench).unwrap_or_else(|_| UNREADABLE.to_owned());
        (bench.name.clone(), vec![name(BenchAnswer::place(folder, &bench.name, &sum))])
    };
    plan.benches.iter().map(of).collect()
}

/// A row for each answer, by bench.
fn rows_in(folder: &Path) -> Result<Vec<BenchRow>, FleetError> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(FleetError::file(folder))? {
        let path = entry.map_err(FleetError::file(folder))?.path();
        if path.extension().is_some_and(|ending| ending == "json") {
            files.push(path);
        }
    }
    files.sort();
    let mut rows = files.iter().map(|path| row(path)).collect::<Result<Vec<_>, _>>()?;
    rows.sort_by(|a, b| (&a.bench, &a.file).cmp(&(&b.bench, &b.file)));
    Ok(rows)
}

fn row(path: &Path) -> Result<BenchRow, FleetError> {
    let (answer, found) = BenchAnswer::load(path)?;
    let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let page =
        path.with_extension("html").is_file().then(|| format!("{}.html", file.trim_end_matches(".json")));
    let found = found.unwrap_or_default();
    let in_model = found.in_model();
    let DiagnosisExtract { verdict, effects, alternatives, parameters, changed_parameters, error, .. } =
        found;
    let of_effects = parameters.into_iter().filter_map(|(name, it)| Some((name, (it.value?, it.unit))));
    let changed = changed_parameters.into_iter().filter_map(|it| Some((it.name, (it.to?, it.unit))));
    Ok(BenchRow {
        bench: answer.bench,
        file,
        page,
        error: answer.error,
        verdict,
        effects,
        in_model,
        alternatives,
        parameters: of_effects.chain(changed).collect(),
        measure: error.measure,
        noise_floor: error.noise_floor,
        base: error.base.validate,
        refitted: error.recalibrated.validate,
        extended: error.extended.validate,
    })
}
