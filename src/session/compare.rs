//! Where models fail, and how far an extension mends it.

use std::path::PathBuf;

use super::modelled::Modelled;
use super::{Job, Progress, SessionError};
use crate::compare::{self, CompareConfig, Comparison};
use crate::emulate::Impulse;
use crate::model::Model;
use crate::screening::ScreenedLog;
use crate::screening::same_bench::of_one_bench;
use crate::studies::controller_comparison::{self, RunComparison};

/// Compares every model with every log, log by log, each judged with what the others show of the bench.
///
/// In a program: `examples/compare.rs`.
///
/// # Errors
/// [`SessionError::Compare`] of the first log that cannot be compared.
pub fn compare(
    models: &[Model],
    logs: &[ScreenedLog],
    config: &CompareConfig,
    job: &Job,
) -> Result<Vec<Vec<Comparison>>, SessionError> {
    let logs = of_one_bench(logs);
    let each = logs.iter().enumerate().map(|(index, log)| {
        job.report(Progress::Step { name: log.source_name(), number: index + 1, of: logs.len() });
        let Modelled { train, finding, .. } = Modelled::of(std::slice::from_ref(log), &[]);
        let mut found = job.run(|| compare::compare(models, train.first().unwrap_or(log), config))?;
        found.iter_mut().for_each(|comparison| comparison.findings.extend(finding.clone()));
        Ok(found)
    });
    each.collect()
}

/// Compares a model and its extension with every log, log by log: what a page shows beside each other.
///
/// # Errors
/// [`SessionError::Compare`] of the first log that cannot be compared.
pub fn compare_extension(
    base: &Model,
    extended: &Model,
    logs: &[ScreenedLog],
    config: &CompareConfig,
    job: &Job,
) -> Result<Vec<Vec<Comparison>>, SessionError> {
    let extended = Model { name: format!("{}, extended", base.name), ..extended.clone() };
    compare(&[base.clone(), extended], logs, config, job)
}

/// Holds recordings of runs beside each other in which the body was struck; `given` is what struck it where a recording does
/// not say.
///
/// # Errors
/// [`SessionError::Runs`] naming the file.
pub fn compare_runs(
    recordings: &[PathBuf],
    given: Option<Impulse>,
    job: &Job,
) -> Result<RunComparison, SessionError> {
    job.run(|| controller_comparison::compare_runs(recordings, given))
}
