//! `rotorbench arm`: arm a running bench.

use super::{CliError, CliResult};

/// Arguments of `arm`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`arm` is not part of this build"))
}
