//! What lies on the workbench: logs, models, what was found of them, and what is being done. It is plain data behind one lock;
//! who changes it counts `revision` up, by which every page sees that it has to look again.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::ActError;
use super::bands::Bands;
use super::choice::Choice;
use super::columns::{DeskMapping, Guess};
use super::places::Stamp;
use super::shown::{ShownChannel, ShownComparison};
use super::thresholds::THRESHOLDS;
use crate::cancel::Cancel;
use crate::model::Model;
use crate::screening::ScreenedLog;

/// What a log is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum LogUse {
    /// Models are fitted on it.
    Fit,
    /// Errors are judged on it.
    HeldOut,
    /// It is looked at only.
    Look,
}

/// A log on the workbench.
#[derive(Debug)]
pub(super) struct DeskLog {
    /// Its number on this workbench.
    pub id: u64,
    /// Its path as one types it.
    pub path: PathBuf,
    /// The same as text.
    pub typed: String,
    pub role: LogUse,
    /// Which part of it counts: another one is another log.
    pub choice: Choice,
    /// What a session remembers of it.
    pub remembered: Option<ReadFrom>,
    pub content: LogContent,
    pub compared: Option<Compared>,
    /// It is to be read again: there may be more of it.
    pub again: bool,
    /// Why it could not be read again; what was read before stays.
    pub stuck: Option<String>,
    /// What its columns may mean, of a foreign log.
    pub guess: Option<Box<Guess>>,
    /// What they mean, confirmed.
    pub mapping: Option<Arc<DeskMapping>>,
}

/// How far the reading of a log is.
#[derive(Debug, Clone)]
pub(super) enum LogContent {
    /// It waits to be read.
    Opening,
    /// What its columns mean is a guess that nobody has confirmed.
    Guessed,
    /// The file holds several logs, and none was chosen: their numbers and how long they are [s], where the file says it.
    Parts(Vec<(usize, Option<f64>)>),
    /// It was read.
    Open(Arc<OpenLog>),
    /// It cannot be read, and why.
    Failed(String),
}

/// A log that was read.
#[derive(Debug)]
pub(super) struct OpenLog {
    pub log: ScreenedLog,
    /// The file as it was just before.
    pub stamp: Option<Stamp>,
    /// Name of its format.
    pub format: &'static str,
    /// Of a capture, whose channels are what a bench file says of its frames: the hash of that.
    pub bench: Option<String>,
    /// Whether a command's `--mapping` would be for it, too.
    pub takes_mapping: bool,
    /// Which log of its file it is, and how many that holds, where it says so.
    pub part: Option<(usize, usize)>,
    /// What the reader left out and what screening found, in sentences.
    pub notes: Vec<String>,
    /// The same where it has rows.
    pub bands: Bands,
    pub channels: Vec<ShownChannel>,
}

impl OpenLog {
    pub fn read_from(&self) -> ReadFrom {
        ReadFrom { sha256: self.log.raw().sha256().to_owned(), bench: self.bench.clone() }
    }
}

/// The models that are shown, held beside a log.
#[derive(Debug, Clone)]
pub(super) struct Compared {
    /// The log as it was then: it may have grown since.
    pub content: Arc<OpenLog>,
    /// Ids of the models, in the order of the comparisons.
    pub models: Vec<u64>,
    /// One for each model; or why they could not be compared.
    pub found: Result<Arc<Vec<ShownComparison>>, String>,
}

/// Where a model is from.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Origin {
    /// The paper's, or a file, as one types it.
    File(String),
    /// Made here.
    Made,
    /// Made here to be looked at: it goes when another is tried, and stays when it is added.
    Tried,
}

/// A model on the workbench.
#[derive(Debug, Clone)]
pub(super) struct DeskModel {
    /// Its number on this workbench.
    pub id: u64,
    pub model: Model,
    pub origin: Origin,
    /// Whether its curves are drawn.
    pub shown: bool,
    /// What to know about how it was made, in sentences.
    pub notes: Vec<String>,
    /// The model it was made from, what was added and by which logs: the same again is not fitted again.
    pub recipe: Option<Recipe>,
}

/// What a log was read from, by hashes: where one of them is another, so is the log.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ReadFrom {
    /// SHA-256 of its bytes, in hexadecimal; empty where it was not read.
    pub sha256: String,
    /// Of a capture that of what the bench file said of its frames.
    pub bench: Option<String>,
}

/// A log as it was read: one that has grown since is another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReadLog {
    pub id: u64,
    pub from: ReadFrom,
}

/// What a search was asked of: a model, and logs as they were then.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SearchInputs {
    pub model: u64,
    pub fit: Vec<ReadLog>,
    pub held_out: Vec<ReadLog>,
}

impl SearchInputs {
    /// The chosen model, by the logs as they lie on the desk.
    pub fn of(desk: &Desk) -> Self {
        let of_role = |role| {
            let logs = desk.logs.iter().filter(|log| log.role == role);
            logs.map(|log| ReadLog { id: log.id, from: log.read_from() }).collect()
        };
        Self { model: desk.chosen, fit: of_role(LogUse::Fit), held_out: of_role(LogUse::HeldOut) }
    }
}

/// What a model was made of.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Recipe {
    pub added: Vec<String>,
    pub of: SearchInputs,
}

/// What a search looks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum SearchKind {
    Identify,
    Diagnose,
    Extend,
    Try,
    Recalibrate,
    Discover,
}

/// How a search is, or ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "state", content = "why")]
pub(super) enum SearchState {
    Running,
    Done,
    Cancelled,
    Failed(String),
}

/// The newest search.
#[derive(Debug, Clone)]
pub(super) struct DeskSearch {
    pub id: u64,
    pub kind: SearchKind,
    pub state: SearchState,
    /// Candidates fitted so far.
    pub fitted: usize,
    /// Ids of the set in the lead.
    pub leading: Vec<String>,
    /// Sets fitted to the end, the best first, and what each leaves: rms over that of the noise [-].
    pub tried: Vec<(Vec<String>, f64)>,
    pub began: Instant,
    pub took: Option<Duration>,
    pub cancel: Cancel,
}

impl DeskSearch {
    /// Keeps a set that was fitted to the end, among the best ones.
    pub fn take(&mut self, effects: &[String], over_noise: f64) {
        // One that was fitted again counts as it is now; the base alone is no candidate.
        self.tried.retain(|(other, _)| other != effects);
        if over_noise.is_finite() && !effects.is_empty() {
            let at = self.tried.partition_point(|(_, other)| *other <= over_noise);
            self.tried.insert(at, (effects.to_vec(), over_noise));
            self.tried.truncate(THRESHOLDS.shown_tried);
        }
    }
}

/// What a search said, and of what.
#[derive(Debug, Clone)]
pub(super) struct Answered {
    pub of: SearchInputs,
    /// As the page shows it.
    pub shown: Arc<Value>,
}

/// What the search for a law said.
#[derive(Debug, Clone)]
pub(super) struct Discovered {
    pub answered: Answered,
    /// The model with the law, where there is one, and what to know of it in sentences.
    pub made: Option<(Model, Vec<String>)>,
}

/// What is being read or compared, and the wish to end it.
#[derive(Debug)]
pub(super) struct Looking {
    /// The log, as one types it.
    pub name: String,
    pub cancel: Cancel,
    /// The log that is being read; `None` where one is being compared.
    pub reads: Option<u64>,
}

/// All of it.
#[derive(Debug)]
pub(super) struct Desk {
    pub revision: u64,
    pub logs: Vec<DeskLog>,
    pub models: Vec<DeskModel>,
    /// Id of the model that is diagnosed and extended.
    pub chosen: u64,
    pub search: Option<DeskSearch>,
    /// What the last search for missing effects said, and the last for a law.
    pub answered: Option<Answered>,
    pub discovered: Option<Discovered>,
    pub looking: Option<Looking>,
    /// The bench file by which captures are read, as one types it.
    pub bench: Option<PathBuf>,
    /// That of the session, where it cannot be read: the next session names it again.
    pub lost_bench: Option<PathBuf>,
    /// The commands that do what was done, in its order.
    pub done: Vec<String>,
    /// What went wrong beside an act, newest last.
    pub notices: Vec<String>,
    next_id: u64,
    next_step: u64,
}

impl Desk {
    /// A desk with the paper's model on it.
    pub fn new() -> Self {
        let paper = DeskModel {
            id: 1,
            model: Model::paper(),
            origin: Origin::File("paper".to_owned()),
            shown: true,
            notes: Vec::new(),
            recipe: None,
        };
        Self {
            revision: 0,
            logs: Vec::new(),
            models: vec![paper],
            chosen: 1,
            search: None,
            answered: None,
            discovered: None,
            looking: None,
            bench: None,
            lost_bench: None,
            done: Vec::new(),
            notices: Vec::new(),
            next_id: 2,
            next_step: 1,
        }
    }

    /// A number that nothing else on this desk has.
    pub fn fresh_id(&mut self) -> u64 {
        self.next_id += 1;
        self.next_id - 1
    }

    /// A name that no model on this desk has, no command of it wrote, and no file here has: that of its file when it is exported.
    pub fn fresh_name(&mut self, stem: &str) -> String {
        loop {
            let name = format!("{stem}-{}", self.next_step);
            self.next_step += 1;
            let file = format!("{name}.toml");
            let is_written = |command: &String| command.ends_with(&format!(" -o {file}"));
            let is_new =
                self.models.iter().all(|it| it.model.name != name) && !self.done.iter().any(is_written);
            if is_new && !Path::new(&file).exists() {
                return name;
            }
        }
    }

    pub fn log(&self, id: u64) -> Result<&DeskLog, ActError> {
        self.logs.iter().find(|log| log.id == id).ok_or(ActError::Gone { what: "log", id })
    }

    pub fn log_mut(&mut self, id: u64) -> Result<&mut DeskLog, ActError> {
        self.logs.iter_mut().find(|log| log.id == id).ok_or(ActError::Gone { what: "log", id })
    }

    pub fn model(&self, id: u64) -> Result<&DeskModel, ActError> {
        self.models.iter().find(|model| model.id == id).ok_or(ActError::Gone { what: "model", id })
    }

    pub fn model_mut(&mut self, id: u64) -> Result<&mut DeskModel, ActError> {
        self.models.iter_mut().find(|model| model.id == id).ok_or(ActError::Gone { what: "model", id })
    }

    /// Ids of the models whose curves are drawn, in their order.
    pub fn shown(&self) -> Vec<u64> {
        self.models.iter().filter(|model| model.shown).map(|model| model.id).collect()
    }

    pub fn is_searching(&self) -> bool {
        self.search.as_ref().is_some_and(|search| search.state == SearchState::Running)
    }

    /// Ends what is being compared when it is no longer what is to be seen. A log is read to its end, whatever is drawn.
    pub fn look_anew(&self) {
        if let Some(looking) = self.looking.as_ref().filter(|looking| looking.reads.is_none()) {
            looking.cancel.request();
        }
    }

    /// Ends the reading of a log that is no longer here.
    pub fn leave_log(&self, log: u64) {
        if let Some(looking) = self.looking.as_ref().filter(|looking| looking.reads == Some(log)) {
            looking.cancel.request();
        }
    }
}

impl DeskLog {
    /// Its content, when it was read.
    pub fn open(&self) -> Result<&Arc<OpenLog>, ActError> {
        match &self.content {
            LogContent::Open(log) => Ok(log),
            LogContent::Guessed => Err(ActError::Guessed(self.typed.clone())),
            LogContent::Parts(_) => Err(ActError::Several(self.typed.clone())),
            _ => Err(ActError::Opening(self.typed.clone())),
        }
    }

    /// What it was read from; where it was not read, what a session remembers, or nothing.
    pub fn read_from(&self) -> ReadFrom {
        match &self.content {
            LogContent::Open(open) => open.read_from(),
            _ => self.remembered.clone().unwrap_or_default(),
        }
    }
}

impl DeskModel {
    /// Whether it is the model that every desk has.
    pub fn is_paper(&self) -> bool {
        matches!(&self.origin, Origin::File(typed) if typed == "paper")
    }

    /// The path by which a command names it: its file, or the one that it would be exported to.
    pub fn typed(&self) -> String {
        match &self.origin {
            Origin::File(typed) => typed.clone(),
            Origin::Made | Origin::Tried => format!("{}.toml", self.model.name),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Else commands that are run in their order would find a file of theirs there already.
    #[test]
    fn a_name_that_a_command_of_a_session_wrote_is_not_given_again() {
        let mut desk = Desk::new();
        desk.done.push("rotorbench extend --model paper --effect transport_delay -o step-1.toml".to_owned());
        assert_eq!(desk.fresh_name("step"), "step-2");
        assert_eq!(desk.fresh_name("law"), "law-3");
        // Nor that of a file.
        let folder = tempfile::tempdir().expect("a folder");
        let stem = folder.path().join("step").display().to_string();
        std::fs::write(format!("{stem}-4.toml"), "").expect("written");
        assert_eq!(desk.fresh_name(&stem), format!("{stem}-5"));
    }
}
