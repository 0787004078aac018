//! An experiment on the emulated bench, as a log.

use super::{Job, SessionError};
use crate::bench::BenchConfig;
use crate::runtime::ExperimentPlan;
use crate::runtime::ProcessError;
use crate::runtime::experiment;
use crate::screening::ScreenedLog;

/// Runs `plan` on the emulated bench of `bench` in virtual time. The log, called `name`, begins with the first excited period.
///
/// In a program: `examples/compare.rs`.
///
/// # Errors
/// [`SessionError::Process`] for settings that cannot be, or a limit of the guard that would clip the experiment.
pub fn run_emulated(
    bench: &BenchConfig,
    plan: &ExperimentPlan,
    name: &str,
    job: &Job,
) -> Result<ScreenedLog, SessionError> {
    let (trace, _) = job.run(|| experiment::in_lockstep(bench, plan, &mut (), |_| true))?;
    Ok(trace.into_dataset(name).map_err(ProcessError::from)?.into())
}
