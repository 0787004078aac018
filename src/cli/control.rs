//! `rotorbench control`: run one controller on a fixed period.

use super::operate::BenchArguments;
use super::{CliResult, Outcome, output};
use crate::report::run_summary;
use crate::rt::Shutdown;
use crate::runtime::lockstep::two_process;
use crate::runtime::thresholds::THRESHOLDS;
use crate::runtime::{control, controller_plant};

/// Arguments of `control`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// End after this many seconds
    #[arg(long, value_name = "S", value_parser = super::operate::seconds)]
    seconds: Option<f64>,
    /// In virtual time: answer the steps of `emulate --shm --lockstep`, until none comes any more
    #[arg(long, conflicts_with = "seconds")]
    lockstep: bool,
    /// In lockstep: how long an emulator may be silent before it is taken as gone
    #[arg(long, value_name = "S", requires = "lockstep", default_value_t = THRESHOLDS.patience_s,
          value_parser = super::operate::seconds)]
    patience: f64,
    /// Write the summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = arguments.bench.load()?;
    let source = controller_plant::command_source(&config)?;
    let shutdown = Shutdown::listen()?;
    if arguments.lockstep {
        let summary = two_process::answer(&config, source, arguments.patience, &shutdown)?;
        output::say(arguments.json, &summary, || run_summary::answered(&summary))?;
        return Ok(if summary.complete { Outcome::Done } else { Outcome::FoundWanting });
    }
    let summary = control::control(&config, source, arguments.seconds, &shutdown)?;
    output::say(arguments.json, &summary, || run_summary::controlled(&summary))?;
    Ok(Outcome::Done)
}
