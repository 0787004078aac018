//! `rotorbench export`: write a recording as CSV or candump log.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::output::{Force, writable};
use super::usage_error::UsageError;
use super::{CliResult, Outcome};
use crate::report;
use crate::session::{self, ExportPart};

/// Arguments of `export`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The recording
    recording: PathBuf,
    /// Write the CSV log here: one row for each period of the guard
    #[arg(short, long, value_name = "FILE.csv")]
    output: Option<PathBuf>,
    /// Write the raw frames here, as `candump -L` does
    #[arg(long, value_name = "FILE.log")]
    candump: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
    /// Summary as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// What was written, as `--json` says it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Default, Serialize)]
pub(super) struct ExportAnswer<'a> {
    /// The CSV log, where one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    rows: Option<Written<'a>>,
    /// The raw frames, where they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<Written<'a>>,
}

/// One file that was written.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
struct Written<'a> {
    /// The file.
    file: &'a Path,
    /// Rows or frames in it.
    written: u64,
    /// Periods out of order, left out.
    out_of_order: u64,
    /// Records that the recorder lost.
    lost_by_recorder: u64,
    /// Where and why the recording is cut off; `null` where it is whole.
    cut_off: Option<String>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let outputs =
        [(ExportPart::Rows, arguments.output.as_ref()), (ExportPart::Frames, arguments.candump.as_ref())];
    if outputs.iter().all(|(_, output)| output.is_none()) {
        return Err(UsageError::NoOutput.into());
    }
    let is_frames = |path: &&PathBuf| path.extension().is_some_and(|it| it == "log" || it == "candump");
    if let Some(path) = arguments.output.as_ref().filter(is_frames) {
        return Err(UsageError::NamedLikeFrames { path: path.clone() }.into());
    }
    writable(arguments.output.iter().chain(&arguments.candump), [&arguments.recording], arguments.force)?;
    let mut answer = ExportAnswer::default();
    let mut outcome = Outcome::Done;
    for (part, output) in outputs {
        let Some(output) = output else { continue };
        let summary = session::export(&arguments.recording, part, output)?;
        if summary.written == 0 {
            outcome = Outcome::FoundWanting;
        }
        if arguments.json {
            let place = match part {
                ExportPart::Rows => &mut answer.rows,
                ExportPart::Frames => &mut answer.frames,
            };
            *place = Some(Written {
                file: output,
                written: summary.written,
                out_of_order: summary.out_of_order,
                lost_by_recorder: summary.lost,
                cut_off: report::files::cut_off(&summary.end),
            });
            continue;
        }
        print!("{}", report::export::text(&summary, part, output));
    }
    if arguments.json {
        println!("{}", report::json::answer(&answer)?);
    }
    Ok(outcome)
}
