//! `rotorbench control`: run one controller on a fixed period.

use super::{CliError, CliResult};

/// Arguments of `control`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`control` is not part of this build"))
}
