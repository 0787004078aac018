//! `rotorbench extend`: add an effect to a model and show the fall of the error.

use super::{CliError, CliResult};

/// Arguments of `extend`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`extend` is not part of this build"))
}
