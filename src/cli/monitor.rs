//! `rotorbench monitor`: watch a running bench.

use super::{CliError, CliResult};

/// Arguments of `monitor`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`monitor` is not part of this build"))
}
