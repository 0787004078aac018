//! `rotorbench doctor`: what this machine can and cannot do, and the command that mends it.

use std::path::PathBuf;

use super::{CliResult, Outcome, output};
use crate::bench::BenchConfig;
use crate::report::doctor;
use crate::session::{MachineCheck, check_machine};

/// Arguments of `doctor`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Bench file: its interface and what it left; without one, the built-in bench's interface and what any bench left
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// Remove what dead benches left in shared memory
    #[arg(long)]
    fix: bool,
    /// Findings as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = BenchConfig::load(arguments.config.as_deref())?;
    let only = arguments.config.as_ref().map(|_| config.name.as_str());
    let looked = check_machine(&config, only, arguments.fix);
    let rows = doctor::rows(&looked);
    output::say(arguments.json, &rows, || doctor::text(&rows))?;
    Ok(if looked.iter().any(MachineCheck::is_wanting) { Outcome::FoundWanting } else { Outcome::Done })
}
