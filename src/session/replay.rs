//! A recording, replayed: controller and guard once more on what they were given, with settings changed.

use std::path::{Path, PathBuf};

use super::replay_error::{ReplayError, SetError};
use crate::bench::BenchConfig;
use crate::model::Model;
use crate::recording::{End, RecordedItem, Recording, RecordingMetadata};
use crate::runtime::ProcessError;
use crate::runtime::replay::{Replay, ReplayResult};
use crate::runtime::{ExperimentPlan, controller_plant};

/// What is replayed, and with what.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ReplayTask {
    /// The recording.
    pub recording: PathBuf,
    /// A bench file in the place of the recorded one.
    pub bench: Option<PathBuf>,
    /// A model in the place of the recorded one.
    pub model: Option<PathBuf>,
    /// Settings of the bench file that are changed, each `key.of.table=value`.
    pub set: Vec<String>,
}

/// What a replay came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Replayed {
    /// Of the controller.
    pub controller: ReplayResult,
    /// Of the guard.
    pub guard: ReplayResult,
    /// Count of the guard's events that were equal.
    pub equal_events: u64,
    /// Count of the records that the recorder lost.
    pub lost: u64,
    /// How the recording ends.
    pub end: End,
}

impl Replayed {
    /// Whether everything recorded could be replayed and was equal.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.controller.is_equal() && self.guard.is_equal()
    }

    /// Whether no step of a controller or guard was met.
    fn is_empty(&self) -> bool {
        let is_empty = |it: &ReplayResult| it.equal + it.unknown == 0 && it.first_difference.is_none();
        is_empty(&self.controller) && is_empty(&self.guard)
    }
}

/// Runs the controller and the guard of a recording again on what it says they were given.
///
/// # Errors
/// A recording, bench file or model that cannot be read; a setting that is not there; a controller, guard or experiment that cannot
/// be built; a recording without a step of either.
pub fn replay(task: &ReplayTask) -> Result<Replayed, ReplayError> {
    let mut recording = Recording::open(&task.recording)?;
    let (config, model) = settings(task, recording.metadata())?;
    let plan = plan(&task.recording, recording.metadata())?;
    let source = controller_plant::command_source_of(&config, &model, plan.as_ref())?;
    let guard = config.guard.build_on(config.period_s, &model).map_err(ProcessError::from)?;
    let mut lost = 0;
    let mut replay = Replay::new(&source, &guard);
    replay.run(recording.by_ref().inspect(|record| {
        if let Ok(RecordedItem::Status(status)) = record {
            lost = status.dropped;
        }
    }))?;
    let Replay { controller, guard_result: guard, equal_events, .. } = replay;
    let end = recording.end().cloned().unwrap_or(End::Whole);
    let replayed = Replayed { controller, guard, equal_events, lost, end };
    if replayed.is_empty() {
        return Err(ReplayError::Nothing { recording: task.recording.clone() });
    }
    Ok(replayed)
}

/// Bench and model of the recording, with what the task changes.
fn settings(task: &ReplayTask, metadata: &RecordingMetadata) -> Result<(BenchConfig, Model), ReplayError> {
    let inside = |file: &str| PathBuf::from(format!("{}: {file}", task.recording.display()));
    let mut config = match &task.bench {
        Some(path) => BenchConfig::load(Some(path))?,
        None => BenchConfig::parse(&metadata.bench, &inside("bench.toml"))?,
    };
    if !task.set.is_empty() {
        // By way of the text: a second way of writing the whole bench would be compiled for nothing else.
        let mut table: toml::Table = toml::from_str(&toml::to_string(&config)?)?;
        for assignment in &task.set {
            let failed = |reason| ReplayError::Set { assignment: assignment.clone(), reason };
            set(&mut table, assignment).map_err(failed)?;
        }
        config = BenchConfig::parse(&toml::to_string(&table)?, Path::new("--set"))?;
    }
    let model = match &task.model {
        Some(path) => Model::load(path)?,
        None => Model::parse(&metadata.model, &inside("model.toml"))?,
    };
    Ok((config, model))
}

/// The experiment of the recording, if there was one.
fn plan(recording: &Path, metadata: &RecordingMetadata) -> Result<Option<ExperimentPlan>, ReplayError> {
    if metadata.experiment.is_empty() {
        return Ok(None);
    }
    let failed = |error| ReplayError::Experiment { recording: recording.to_owned(), error };
    toml::from_str(&metadata.experiment).map(Some).map_err(failed)
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
