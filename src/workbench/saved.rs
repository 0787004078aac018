//! A session as a file: what is open, what was made and by which commands, and what searches said. It opens again next week, and says which logs have
//! changed since.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::WorkbenchError;
use super::choice::Choice;
use super::columns::DeskMapping;
use super::desk::{Desk, LogUse, Origin, ReadFrom};
use super::error::OtherFolder;
use super::kept::{self, SavedAnswer};
use super::places::whole;
use crate::file::toml_error;
use crate::model::Model;

/// The form of the file.
const VERSION: u32 = 1;

/// A session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Saved {
    pub version: u32,
    /// Name of the model that is diagnosed and extended, and which of `models` it is, from 0.
    pub chosen: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen_model: Option<usize>,
    /// Whether the paper's model is drawn.
    pub shows_paper: bool,
    /// The folder in which the commands are typed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// The bench file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<PathBuf>,
    /// The commands that do by hand what was done.
    #[serde(default)]
    pub done: Vec<String>,
    #[serde(default)]
    pub logs: Vec<SavedLog>,
    #[serde(default)]
    pub models: Vec<SavedModel>,
    /// What searches said last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answers: Vec<SavedAnswer>,
}

/// A log of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SavedLog {
    pub path: PathBuf,
    /// SHA-256 of its bytes, in hexadecimal; empty where it was not read.
    pub sha256: String,
    /// Of a capture that of what the bench file said of its frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench_sha256: Option<String>,
    pub role: LogUse,
    /// Which part of it counts.
    #[serde(default, skip_serializing_if = "Choice::is_all")]
    pub choice: Choice,
    /// What its columns mean, of a foreign log.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mapping: Option<DeskMapping>,
}

/// A model of a session: a file, or one that was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SavedModel {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// SHA-256 of the model as it is written, of one in a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    pub shown: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<Model>,
}

impl Saved {
    /// What lies on the desk.
    pub fn of(desk: &Desk) -> Self {
        let logs = desk.logs.iter().map(|log| {
            let ReadFrom { sha256, bench: bench_sha256 } = log.read_from();
            let (path, role, choice) = (whole(&log.path), log.role, log.choice.clone());
            SavedLog { path, sha256, bench_sha256, role, choice, mapping: log.mapping.as_deref().cloned() }
        });
        let kept = || desk.models.iter().filter(|model| model.origin != Origin::Tried);
        let models = kept().map(|it| match &it.origin {
            Origin::File(typed) => SavedModel {
                file: Some(whole(Path::new(typed))),
                sha256: kept::hash(&it.model),
                shown: it.shown,
                model: None,
            },
            _ => SavedModel { file: None, sha256: None, shown: it.shown, model: Some(it.model.clone()) },
        });
        Self {
            version: VERSION,
            chosen: desk.model(desk.chosen).map(|it| it.model.name.clone()).unwrap_or_default(),
            chosen_model: kept().position(|model| model.id == desk.chosen),
            shows_paper: desk.models.first().is_some_and(|paper| paper.shown),
            folder: std::env::current_dir().ok(),
            done: desk.done.clone(),
            bench: desk.bench.as_ref().or(desk.lost_bench.as_ref()).map(|file| whole(file)),
            logs: logs.collect(),
            models: models.collect(),
            answers: kept::of(desk),
        }
    }

    /// Goes to the folder in which its commands are typed, if that is another one, and says so.
    pub fn go_to_folder(&self) -> Option<OtherFolder> {
        let folder = self.folder.as_ref().filter(|_| !self.done.is_empty())?;
        let is_here = std::env::current_dir().is_ok_and(|here| here == *folder);
        let name = || folder.display().to_string();
        (!is_here).then(|| match std::env::set_current_dir(folder) {
            Ok(()) => OtherFolder::There(name()),
            Err(_) => OtherFolder::Gone(name()),
        })
    }

    /// The files that it names.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> + '_ {
        let bench = self.bench.iter().cloned();
        let logs = self.logs.iter().map(|log| log.path.clone());
        bench.chain(logs).chain(self.models.iter().filter_map(|model| model.file.clone()))
    }
}

/// Reads a session file.
pub(super) fn read(path: &Path) -> Result<Saved, WorkbenchError> {
    let refuse = |reason: String| WorkbenchError::Saved { path: path.to_owned(), reason };
    let text = fs::read_to_string(path).map_err(|error| refuse(error.to_string()))?;
    let saved: Saved = toml::from_str(&text).map_err(|error| refuse(toml_error(&text, &error)))?;
    if saved.version != VERSION {
        return Err(refuse(format!("version {}; this program reads version {VERSION}", saved.version)));
    }
    let laws = saved.answers.iter().filter_map(|it| it.law.as_ref());
    for model in saved.models.iter().filter_map(|it| it.model.as_ref()).chain(laws) {
        model.check().map_err(|error| refuse(error.to_string()))?;
    }
    Ok(saved)
}
