//! `rotorbench compare`: where the model fails.

use super::{CliError, CliResult};

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`compare` is not part of this build"))
}
