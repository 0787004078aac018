//! `rotorbench disarm`: disarm a running bench.

use super::{CliError, CliResult};

/// Arguments of `disarm`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`disarm` is not part of this build"))
}
