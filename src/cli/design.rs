//! `rotorbench design`: eigenvalues, gains and margins from a model.

use super::{CliError, CliResult};

/// Arguments of `design`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`design` is not part of this build"))
}
