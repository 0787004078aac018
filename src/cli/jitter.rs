//! `rotorbench jitter`: what this machine's timing is, in cyclictest's terms.

use super::{CliError, CliResult};

/// Arguments of `jitter`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`jitter` is not part of this build"))
}
