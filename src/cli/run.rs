//! `rotorbench run`: bridge and control in one process.

use super::{CliError, CliResult};

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`run` is not part of this build"))
}
