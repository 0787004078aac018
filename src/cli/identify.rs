//! `rotorbench identify`: identify actuator and body from logs.

use super::{CliError, CliResult};

/// Arguments of `identify`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`identify` is not part of this build"))
}
