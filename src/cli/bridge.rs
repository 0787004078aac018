//! `rotorbench bridge`: own the CAN bus: frames to sensors, commands through the guard to frames.

use super::operate::BenchArguments;
use super::{CliResult, Outcome};
use crate::report::run_summary;
use crate::rt::Shutdown;
use crate::runtime::bridge;

/// Arguments of `bridge`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Arm as soon as the checks pass; on a virtual interface only, for scripted runs on the emulator
    #[arg(long)]
    arm: bool,
    /// End after this many seconds
    #[arg(long, value_name = "S", value_parser = super::operate::seconds)]
    seconds: Option<f64>,
    /// Write the summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = arguments.bench.load()?;
    let shutdown = Shutdown::listen()?;
    let summary = bridge::bridge(&config, arguments.arm, arguments.seconds, &shutdown)?;
    if arguments.json {
        println!("{}", crate::report::json::answer(&summary)?);
        return Ok(Outcome::Done);
    }
    println!("{}", run_summary::guard_at_end(&summary.state, &summary.cause));
    print!("{}", run_summary::bus(&summary.bus));
    print!("{}", run_summary::timing(&summary.timing));
    Ok(Outcome::Done)
}
