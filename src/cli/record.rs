//! `rotorbench record`: record a running bench.

use std::path::PathBuf;

use serde::Serialize;

use super::operate::BenchArguments;
use super::output::Force;
use super::progress::ProgressLine;
use super::{CliError, CliResult, Outcome};
use crate::recording::RecorderSummary;
use crate::report::run_summary;
use crate::rt::Shutdown;
use crate::runtime::record;

/// Arguments of `record`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// The recording to make
    #[arg(short, long, value_name = "FILE.mcap")]
    output: PathBuf,
    /// End after this many seconds
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    #[command(flatten)]
    force: Force,
    /// Summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// The summary, as `--json` writes it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(super) struct RecordAnswer {
    /// Records written.
    written: u64,
    /// Records lost, because the recorder or its disk was too slow, or the disk full.
    dropped: u64,
    /// [s] for which the disk was full.
    disk_full_s: f64,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = arguments.bench.load()?;
    arguments.force.make_way(&arguments.output)?;
    let shutdown = Shutdown::listen()?;
    let progress = ProgressLine::start();
    let show = |summary: RecorderSummary| progress.words(|| run_summary::recorder(summary));
    let summary = record::record(&config, &arguments.output, arguments.seconds, &shutdown, show)?;
    drop(progress);
    if arguments.json {
        let RecorderSummary { written, dropped, disk_full_ns } = summary;
        let disk_full_s = crate::clock::span_s(disk_full_ns);
        println!("{}", crate::report::json::answer(&RecordAnswer { written, dropped, disk_full_s })?);
    } else {
        println!("{}: {}", arguments.output.display(), run_summary::recorder(summary));
    }
    Ok(if summary.dropped == 0 { Outcome::Done } else { Outcome::FoundWanting })
}

/// Ends a recording made beside a run, and says on standard error what it amounted to.
pub(super) fn end(recording: Option<record::Background>) -> Result<(), CliError> {
    if let Some(recording) = recording {
        eprintln!("recorded: {}", run_summary::recorder(recording.finish()?));
    }
    Ok(())
}
