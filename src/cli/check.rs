//! `rotorbench check`: resolve and check a bench file: signals, units, bus load.

use super::{CliError, CliResult};

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`check` is not part of this build"))
}
