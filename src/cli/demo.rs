//! `rotorbench demo`: the whole story with no hardware, in under a minute.

use super::{CliError, CliResult};

/// Arguments of `demo`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`demo` is not part of this build"))
}
