//! `rotorbench emulate`: stand in for the hardware, behind shared memory or on a CAN bus.

use super::{CliError, CliResult};

/// Arguments of `emulate`.
#[derive(Debug, clap::Args)]
pub struct Arguments {}

/// Runs the command.
pub fn run(_arguments: &Arguments) -> CliResult {
    Err(CliError::new("`emulate` is not part of this build"))
}
