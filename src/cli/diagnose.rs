//! `rotorbench diagnose`: which physical effect is missing.

use super::{CliError, CliResult};

/// Arguments of `diagnose`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`diagnose` is not part of this build"))
}
