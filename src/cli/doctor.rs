//! `rotorbench doctor`: what this machine can and cannot do, and the command that mends it.

use super::{CliError, CliResult};

/// Arguments of `doctor`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`doctor` is not part of this build"))
}
