//! `rotorbench replay`: run the controller and the guard again on recorded input.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{CliResult, Outcome};
use crate::report;
use crate::runtime::replay::ReplayResult;
use crate::session::{self, ReplayTask};

/// Arguments of `replay`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The recording
    recording: PathBuf,
    /// Replay with this bench file instead of the recorded one
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// Replay with this model instead of the recorded one
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Change one setting of the bench file, such as `controller.emc.alpha=1.1`; may be given again
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Verdict as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// What the replay came to, as `--json` writes it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(super) struct ReplayAnswer<'a> {
    /// The recording.
    recording: &'a Path,
    /// What replaying the controller came to.
    controller: &'a ReplayResult,
    /// What replaying the guard came to.
    guard: &'a ReplayResult,
    /// Events of the guard that were equal.
    equal_guard_events: u64,
    /// Records that the recorder lost.
    lost_by_recorder: u64,
    /// Where and why the recording is cut off; `null` where it is whole.
    cut_off: Option<String>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let replayed = session::replay(&ReplayTask {
        recording: arguments.recording.clone(),
        bench: arguments.config.clone(),
        model: arguments.model.clone(),
        set: arguments.set.clone(),
    })?;
    if arguments.json {
        let report = ReplayAnswer {
            recording: &arguments.recording,
            controller: &replayed.controller,
            guard: &replayed.guard,
            equal_guard_events: replayed.equal_events,
            lost_by_recorder: replayed.lost,
            cut_off: report::files::cut_off(&replayed.end),
        };
        println!("{}", report::json::answer(&report)?);
    } else {
        print!("{}", report::replay::text(&replayed));
    }
    Ok(if replayed.is_equal() { Outcome::Done } else { Outcome::FoundWanting })
}
