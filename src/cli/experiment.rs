//! `rotorbench experiment`: drive the bench with a test signal and record.

use super::{CliError, CliResult};

/// Arguments of `experiment`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`experiment` is not part of this build"))
}
