//! `rotorbench control`: run one controller on a fixed period.

use super::operate::BenchArguments;
use super::{CliResult, Outcome, timing};
use crate::process::{control, plant};
use crate::rt::Shutdown;

/// Arguments of `control`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    bench: BenchArguments,
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
    let pilot = plant::pilot(&config)?;
    let shutdown = Shutdown::listen()?;
    let summary = control::control(&config, pilot, arguments.seconds, &shutdown)?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&summary)?);
        return Ok(Outcome::Done);
    }
    println!("{}", timing::angle(&summary.angle));
    print!("{}", timing::table(&summary.timing));
    Ok(Outcome::Done)
}
