//! `rotorbench bridge`: own the CAN bus: frames to sensors, commands through the guard to frames.

use super::operate::{ArmAndEnd, BenchArguments};
use super::{CliResult, Outcome, output};
use crate::report::run_summary;
use crate::rt::Shutdown;
use crate::runtime::bridge;

/// Arguments of `bridge`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    #[command(flatten)]
    span: ArmAndEnd,
    /// Write the summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = arguments.bench.load()?;
    let shutdown = Shutdown::listen()?;
    let summary = bridge::bridge(&config, arguments.span.arm, arguments.span.seconds, &shutdown)?;
    output::say(arguments.json, &summary, || run_summary::bridge(&summary))?;
    Ok(Outcome::Done)
}
