//! `rotorbench paper`: every table and figure of the paper, ours beside the printed one.

use super::{CliError, CliResult};

/// Arguments of `paper`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`paper` is not part of this build"))
}
