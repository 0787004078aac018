//! `rotorbench replay`: run the controller and the guard again on recorded input.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::usage_error::{SetError, UsageError};
use super::{CliError, CliResult, Outcome};
use crate::bench::BenchConfig;
use crate::model::Model;
use crate::recording::{RecordedItem, Recording, RecordingMetadata};
use crate::report;
use crate::runtime::controller_plant::{self, ExperimentPlan};
use crate::runtime::replay::{Replay, ReplayResult};

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
    let mut recording = Recording::open(&arguments.recording)?;
    let (config, model) = settings(arguments, recording.metadata())?;
    let plan = plan(&arguments.recording, recording.metadata())?;
    let source = controller_plant::command_source_of(&config, &model, plan.as_ref())?;
    let guard = config.guard.build_on(config.period_s, &model)?;
    let mut lost = 0;
    let mut replay = Replay::new(&source, &guard);
    replay.run(recording.by_ref().inspect(|record| {
        if let Ok(RecordedItem::Status(status)) = record {
            lost = status.dropped;
        }
    }))?;
    let (controller, guard) = (&replay.controller, &replay.guard_result);
    if controller.equal + controller.unknown + guard.equal + guard.unknown == 0
        && controller.first_difference.is_none()
        && guard.first_difference.is_none()
    {
        return Err(UsageError::NothingToReplay { recording: arguments.recording.clone() }.into());
    }
    let cut_off = recording.end().and_then(report::files::cut_off);
    if arguments.json {
        let report = ReplayAnswer {
            recording: &arguments.recording,
            controller,
            guard,
            equal_guard_events: replay.equal_events,
            lost_by_recorder: lost,
            cut_off,
        };
        println!("{}", report::json::answer(&report)?);
    } else {
        print!(
            "{}",
            report::replay::text([controller, guard], (replay.equal_events, lost), cut_off.as_deref())
        );
    }
    Ok(if controller.is_equal() && guard.is_equal() { Outcome::Done } else { Outcome::FoundWanting })
}

/// Bench and model of the recording, with what the arguments change.
fn settings(arguments: &Arguments, metadata: &RecordingMetadata) -> Result<(BenchConfig, Model), CliError> {
    let inside = PathBuf::from(format!("{}: bench.toml", arguments.recording.display()));
    let mut config = match &arguments.config {
        Some(path) => BenchConfig::load(Some(path))?,
        None => BenchConfig::parse(&metadata.bench, &inside)?,
    };
    if !arguments.set.is_empty() {
        // By way of the text: a second way of writing the whole bench would be compiled for nothing else.
        let mut table: toml::Table = toml::from_str(&toml::to_string(&config)?)?;
        for assignment in &arguments.set {
            let failed = |reason| UsageError::Set { assignment: assignment.clone(), reason };
            set(&mut table, assignment).map_err(failed)?;
        }
        config = BenchConfig::parse(&toml::to_string(&table)?, Path::new("--set"))?;
    }
    let model = match &arguments.model {
        Some(path) => Model::load(path)?,
        None => Model::parse(
            &metadata.model,
            Path::new(&format!("{}: model.toml", arguments.recording.display())),
        )?,
    };
    Ok((config, model))
}

/// The experiment of the recording, if there was one.
fn plan(recording: &Path, metadata: &RecordingMetadata) -> Result<Option<ExperimentPlan>, CliError> {
    if metadata.experiment.is_empty() {
        return Ok(None);
    }
    let failed = |error| UsageError::RecordedExperiment { recording: recording.to_owned(), error };
    Ok(toml::from_str(&metadata.experiment).map(Some).map_err(failed)?)
}

/// Applies `key.of.table=value` to the bench file's table; the key must be there.
fn set(table: &mut toml::Table, assignment: &str) -> Result<(), SetError> {
    let (path, text) = assignment.split_once('=').ok_or(SetError::Form)?;
    let value: toml::Value = toml::from_str::<toml::Table>(&format!("value = {}", text.trim()))
        .ok()
        .and_then(|mut table| table.remove("value"))
        .ok_or(SetError::Value)?;
    let mut keys = path.trim().split('.').peekable();
    let mut here = table;
    while let Some(key) = keys.next() {
        let there = here.get_mut(key).ok_or_else(|| SetError::NoKey { key: key.to_owned() })?;
        if keys.peek().is_none() {
            *there = value;
            return Ok(());
        }
        here = there.as_table_mut().ok_or_else(|| SetError::NoTable { key: key.to_owned() })?;
    }
    Err(SetError::Empty)
}
