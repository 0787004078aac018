//! `rotorbench effects`: the catalogue of physical effects.

use super::{CliError, CliResult};

/// Arguments of `effects`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`effects` is not part of this build"))
}
