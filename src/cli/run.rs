//! `rotorbench run`: bridge and control in one process; with `--lockstep` on virtual time, the emulator included.

use super::emulate::PlantArguments;
use super::operate::{ArmAndEnd, BenchArguments};
use super::output::Force;
use super::usage_error::UsageError;
use super::{CliResult, Outcome, output};
use crate::can::BusConfig;
use crate::report::run_summary;
use crate::rt::Shutdown;
use crate::runtime::lockstep::run as lockstep_run;
use crate::runtime::record::Background;
use crate::runtime::{controller_plant, run};

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    #[command(flatten)]
    span: ArmAndEnd,
    /// The emulated bench in virtual time, as fast as it can, instead of the bus; 60 seconds by default
    #[arg(long, conflicts_with = "arm")]
    lockstep: bool,
    #[command(flatten)]
    plant: PlantArguments,
    /// Record the bench into this new file
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<std::path::PathBuf>,
    #[command(flatten)]
    force: Force,
    /// Write the summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    if arguments.lockstep {
        return in_lockstep(arguments);
    }
    if !arguments.plant.given().is_empty() {
        return Err(UsageError::PlantOnBus.into());
    }
    let config = arguments.bench.load()?;
    let source = controller_plant::command_source(&config)?;
    arguments.record.as_ref().map_or(Ok(()), |path| arguments.force.make_way(path))?;
    let shutdown = Shutdown::listen()?;
    let recording = arguments.record.as_ref();
    let recording = recording.map(|path| Background::start(&config, path, "run", None)).transpose()?;
    let summary = match run::run(&config, source, arguments.span.arm, arguments.span.seconds, &shutdown) {
        Ok(summary) => summary,
        Err(refused) => {
            if let Some(recording) = recording {
                recording.discard();
            }
            return Err(refused.into());
        }
    };
    super::record::end(recording)?;
    output::say(arguments.json, &summary, || run_summary::run(&summary))?;
    Ok(Outcome::Done)
}

fn in_lockstep(arguments: &Arguments) -> CliResult {
    let mut config = arguments.bench.load()?;
    if config.bus != BusConfig::default() {
        eprintln!("{}", run_summary::NO_BUS);
    }
    arguments.plant.apply(&mut config)?;
    arguments.record.as_ref().map_or(Ok(()), |path| arguments.force.make_way(path))?;
    let shutdown = Shutdown::listen()?;
    let seconds = arguments.span.seconds.unwrap_or(lockstep_run::DEFAULT_S);
    let summary = lockstep_run::run(&config, seconds, arguments.record.as_deref(), &shutdown)?;
    if let Some(recorded) = summary.recorded {
        eprintln!("recorded: {}", run_summary::recorder(recorded));
    }
    super::lockstep::say(&summary, arguments.json)
}
