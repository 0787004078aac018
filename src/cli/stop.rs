//! `rotorbench stop`: emergency stop of a running bench.

use super::{CliError, CliResult};

/// Arguments of `stop`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`stop` is not part of this build"))
}
