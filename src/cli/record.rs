//! `rotorbench record`: record a running bench.

use super::{CliError, CliResult};

/// Arguments of `record`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`record` is not part of this build"))
}
