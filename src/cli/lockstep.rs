//! The end of a run on virtual time, of `run --lockstep` and `emulate --lockstep`.

use super::{CliResult, Outcome, output};
use crate::report::run_summary;
use crate::runtime::lockstep::run::LockstepSummary;

/// Prints what a run on virtual time ended with.
pub(super) fn say(summary: &LockstepSummary, json: bool) -> CliResult {
    output::say(json, summary, || run_summary::lockstep(summary) + "\n")?;
    // A slot without an answer: the controller has vanished.
    Ok(if summary.answered == summary.slots { Outcome::Done } else { Outcome::FoundWanting })
}
