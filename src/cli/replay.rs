//! `rotorbench replay`: run the controller again on recorded input.

use super::{CliError, CliResult};

/// Arguments of `replay`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`replay` is not part of this build"))
}
