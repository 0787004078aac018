//! `rotorbench import`: read a foreign log into the CSV log format.

use super::{CliError, CliResult};

/// Arguments of `import`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`import` is not part of this build"))
}
