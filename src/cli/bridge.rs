//! `rotorbench bridge`: own the CAN bus: frames to sensors, commands through the guard to frames.

use super::{CliError, CliResult};

/// Arguments of `bridge`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`bridge` is not part of this build"))
}
