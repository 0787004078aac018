//! Answers that a session keeps, and whether they still hold when it opens again.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::desk::{Answered, Desk, DeskLog, Discovered, ReadLog, SearchInputs};
use super::error::Outdated;
use super::places::whole;
use crate::log::csv::content_hash;
use crate::model::Model;

/// An answer of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SavedAnswer {
    /// The command that answers so.
    pub search: KeptSearch,
    /// Version of the program that answered.
    pub program: String,
    /// Name of the model that was asked of.
    pub model: String,
    /// SHA-256 of its file's text, in hexadecimal.
    pub model_sha256: String,
    /// Logs of the session that it was fitted on, and those held out.
    pub fit: Vec<PathBuf>,
    #[serde(default)]
    pub held_out: Vec<PathBuf>,
    /// SHA-256 of `answer`.
    pub answer_sha256: String,
    /// The answer as the page shows it, JSON.
    pub answer: String,
    /// What to know of the model with the law, in sentences.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The model with the law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<Model>,
}

/// What was looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum KeptSearch {
    Diagnose,
    Discover,
}

impl KeptSearch {
    pub fn name(self) -> &'static str {
        match self {
            Self::Diagnose => "diagnose",
            Self::Discover => "discover",
        }
    }
}

/// The answers on the desk that can be kept: those of models and logs that are there as they were.
pub(super) fn of(desk: &Desk) -> Vec<SavedAnswer> {
    let missing = desk.answered.as_ref().map(|it| (KeptSearch::Diagnose, it, None));
    let law = desk.discovered.as_ref().map(|it| (KeptSearch::Discover, &it.answered, it.made.as_ref()));
    let all = missing.into_iter().chain(law);
    all.filter_map(|(search, answered, made)| saved(desk, search, answered, made)).collect()
}

fn saved(
    desk: &Desk,
    search: KeptSearch,
    answered: &Answered,
    made: Option<&(Model, Vec<String>)>,
) -> Option<SavedAnswer> {
    let SearchInputs { model, fit, held_out } = &answered.of;
    let model = &desk.model(*model).ok()?.model;
    let paths = |logs: &[ReadLog]| -> Option<Vec<PathBuf>> {
        let path = |read: &ReadLog| {
            let log = desk.log(read.id).ok().filter(|log| log.read_from() == read.from)?;
            // A session knows a log by its path alone.
            let is_it = |other: &DeskLog| other.path != log.path || other.choice == log.choice;
            desk.logs.iter().all(is_it).then_some(())?;
            Some(whole(&log.path))
        };
        logs.iter().map(path).collect()
    };
    let answer = answered.shown.to_string();
    Some(SavedAnswer {
        search,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        model: model.name.clone(),
        model_sha256: hash(model)?,
        fit: paths(fit)?,
        held_out: paths(held_out)?,
        answer_sha256: content_hash(answer.as_bytes()),
        answer,
        notes: made.map(|(_, notes)| notes.clone()).unwrap_or_default(),
        law: made.map(|(model, _)| model.clone()),
    })
}

/// SHA-256 of a model's text: what a comment in its file says does not count.
pub(super) fn hash(model: &Model) -> Option<String> {
    Some(content_hash(model.emit().ok()?.as_bytes()))
}

/// Puts an answer back where its model is as it was; its logs are looked at when they are read.
///
/// # Errors
/// Why it does not hold any more.
pub(super) fn lay(desk: &mut Desk, saved: SavedAnswer) -> Result<(), Outdated> {
    let search = saved.search.name();
    if saved.program != env!("CARGO_PKG_VERSION") {
        return Err(Outdated::Program { search, version: saved.program });
    }
    let is_it = |hash: &String| *hash == saved.model_sha256;
    let model = desk.models.iter().find(|it| hash(&it.model).as_ref().is_some_and(is_it));
    let Some(model) = model.map(|it| it.id) else {
        return Err(Outdated::File { search, file: saved.model });
    };
    let read = |paths: &[PathBuf]| -> Result<Vec<ReadLog>, Outdated> {
        paths.iter().map(|path| log_at(desk, path).ok_or_else(|| outdated(search, path))).collect()
    };
    let of = SearchInputs { model, fit: read(&saved.fit)?, held_out: read(&saved.held_out)? };
    let is_whole = content_hash(saved.answer.as_bytes()) == saved.answer_sha256;
    let shown = Some(&saved.answer).filter(|_| is_whole).and_then(|text| serde_json::from_str(text).ok());
    let shown: Value = shown.filter(|it| has_its_parts(it, saved.search)).ok_or(Outdated::Text { search })?;
    let answered = Answered { of, shown: Arc::new(shown) };
    match saved.search {
        KeptSearch::Diagnose => desk.answered = Some(answered),
        KeptSearch::Discover => {
            let made = saved.law.map(|law| (law, saved.notes));
            desk.discovered = Some(Discovered { answered, made });
        }
    }
    Ok(())
}

/// Whether a text that somebody may have written has what the page looks for in such an answer.
fn has_its_parts(answer: &Value, search: KeptSearch) -> bool {
    let (texts, lists, tables): (&[&str], &[&str], &[&str]) = match search {
        KeptSearch::Diagnose => {
            let lists = &["effects", "alternatives", "candidates", "findings", "next"];
            (&["verdict", "sentence", "unit"], lists, &["error", "cards"])
        }
        KeptSearch::Discover => (&["verdict", "sentence", "unit", "by_hand"], &["beneath"], &[]),
    };
    texts.iter().all(|name| answer[*name].is_string())
        && lists.iter().all(|name| answer[*name].is_array())
        && tables.iter().all(|name| answer[*name].is_object())
}

fn outdated(search: &'static str, path: &Path) -> Outdated {
    Outdated::File { search, file: path.display().to_string() }
}

fn log_at(desk: &Desk, path: &Path) -> Option<ReadLog> {
    let log = desk.logs.iter().find(|log| whole(&log.path) == *path)?;
    Some(ReadLog { id: log.id, from: log.read_from() })
}

/// Takes away the answers that were of a log, since the file of this name is another now or cannot be read, and says so.
pub(super) fn drop_of_log(desk: &mut Desk, log: u64, name: &str) {
    let is_of = |it: &Answered| it.of.fit.iter().chain(&it.of.held_out).any(|read| read.id == log);
    let mut dropped = Vec::new();
    if desk.answered.take_if(|it| is_of(it)).is_some() {
        dropped.push(KeptSearch::Diagnose);
    }
    if desk.discovered.take_if(|it| is_of(&it.answered)).is_some() {
        dropped.push(KeptSearch::Discover);
    }
    let said = dropped
        .into_iter()
        .map(|search| Outdated::File { search: search.name(), file: name.to_owned() }.to_string());
    desk.notices.extend(said);
}
