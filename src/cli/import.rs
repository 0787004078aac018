//! `rotorbench import`: read a foreign log into the CSV log format, and say what it is like.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::watched::cancellable;
use super::{CliResult, Outcome};
use crate::log::can_capture::CaptureNotes;
use crate::log::{Notes, csv};
use crate::report::import;
use crate::screening::summary::LogSummary;
use crate::session::{self, Job, Opened, Source};

/// Arguments of `import`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The log: foreign CSV with --mapping, a `candump -L` log (its DBC files and roles from --config), a recording of
    /// ours, or a log that is in our format already
    log: PathBuf,
    /// What its columns mean: a mapping file, or the name of a shipped mapping (`rcbenchmark`)
    #[arg(long, value_name = "FILE|NAME")]
    mapping: Option<String>,
    /// Which log of the file, from 1, where time begins anew inside it
    #[arg(long, value_name = "N")]
    part: Option<usize>,
    /// Bench file with the DBC files and roles that say what the frames of a candump log mean
    #[arg(long, value_name = "FILE", conflicts_with = "mapping")]
    pub(super) config: Option<PathBuf>,
    /// Only frames of this interface of a candump log
    #[arg(long, value_name = "IFACE")]
    interface: Option<String>,
    /// Write the log here; without it only the report is made
    #[arg(short, long, value_name = "FILE.csv")]
    output: Option<PathBuf>,
    /// Report as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// What `import` found.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(super) struct Report<'a> {
    source: &'a str,
    sha256: &'a str,
    notes: &'a Notes,
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<&'a CaptureNotes>,
    findings: &'a LogSummary,
    output: Option<&'a Path>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let mapping = arguments.mapping.as_ref().map(PathBuf::from);
    let inputs = [Some(&arguments.log), mapping.as_ref(), arguments.config.as_ref()];
    super::output::writable(&arguments.output, inputs.into_iter().flatten())?;
    let source = Source {
        path: &arguments.log,
        mapping: arguments.mapping.as_deref(),
        part: arguments.part,
        bench: arguments.config.as_deref(),
        interface: arguments.interface.as_deref(),
    };
    let (opened, findings) = cancellable(|cancel| {
        let opened = session::open(&source, &Job::unwatched(cancel))?;
        let findings = LogSummary::of(&opened.log);
        Ok((opened, findings))
    })?;
    let Opened { log, notes, frames } = opened;
    if let Some(output) = &arguments.output {
        csv::write(&log, output)?;
    }
    if arguments.json {
        let report = Report {
            source: log.source_name(),
            sha256: log.sha256(),
            notes: &notes,
            frames: frames.as_ref(),
            findings: &findings,
            output: arguments.output.as_deref(),
        };
        println!("{}", crate::report::json::answer(&report)?);
    } else {
        print!("{}", import::text(&log, &notes, &findings));
        if let Some(frames) = &frames {
            print!("{}", import::frames(frames));
        }
        if let Some(output) = &arguments.output {
            println!("written: {}", output.display());
        }
    }
    Ok(Outcome::Done)
}
