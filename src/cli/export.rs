//! `rotorbench export`: write a recording as CSV or candump log.

use super::{CliError, CliResult};

/// Arguments of `export`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`export` is not part of this build"))
}
