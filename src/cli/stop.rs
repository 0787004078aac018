//! `rotorbench stop`: emergency stop of a running bench.

use super::CliResult;
use super::operate::{self, BenchArguments};
use crate::guard::OperatorAct;

/// Arguments of `stop`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    operate::run(&arguments.bench, OperatorAct::Stop)
}
