//! `rotorbench run`: bridge and control in one process.

use super::operate::BenchArguments;
use super::{CliResult, Outcome, timing};
use crate::process::record::Background;
use crate::process::{plant, run};
use crate::rt::Shutdown;

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    bench: BenchArguments,
    /// Arm as soon as the checks pass; on a virtual interface only, for scripted runs on the emulator
    #[arg(long)]
    arm: bool,
    /// End after this many seconds
    #[arg(long, value_name = "S", value_parser = super::operate::seconds)]
    seconds: Option<f64>,
    /// Record the bench into this new file
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<std::path::PathBuf>,
    /// Write the summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = arguments.bench.load()?;
    let pilot = plant::pilot(&config)?;
    let shutdown = Shutdown::listen()?;
    let recording = arguments.record.as_ref();
    let recording = recording.map(|path| Background::start(&config, path, "run", None)).transpose()?;
    let summary = run::run(&config, pilot, arguments.arm, arguments.seconds, &shutdown)?;
    super::record::end(recording)?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&summary)?);
        return Ok(Outcome::Done);
    }
    println!("{}", timing::angle(&summary.angle));
    println!("guard: {}", summary.state);
    for event in &summary.guard_events {
        println!("  {:9.3} s  {} -> {}: {}", event.time_s, event.from, event.to, event.cause);
    }
    print!("{}", timing::bus(&summary.bus));
    print!("{}", timing::table(&summary.timing));
    Ok(Outcome::Done)
}
