//! Laying things on the desk and taking them away: what takes no time.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::act::Act;
use super::choice::Choice;
use super::columns::DeskMapping;
use super::desk::{
    Desk, DeskLog, DeskModel, LogContent, LogUse, Origin, ReadFrom, SearchInputs, SearchState,
};
use super::error::ChangedModel;
use super::places::{Places, as_typed};
use super::saved::{Saved, SavedLog, SavedModel};
use super::{ActError, WorkbenchError, by_hand, guesses, kept};
use crate::model::Model;
use crate::report::findings::explained;
use crate::session;

/// Lays a log down, to be read.
pub(super) fn lay_log(
    desk: &mut Desk,
    path: PathBuf,
    role: LogUse,
    choice: Choice,
    saved: Option<(ReadFrom, Option<DeskMapping>)>,
) {
    // By the path that a command would have: a model's ladder names its logs by it.
    let (id, path) = (desk.fresh_id(), as_typed(&path));
    let typed = path.display().to_string();
    let content = LogContent::Opening;
    let (remembered, mapping) = saved.map_or((None, None), |(from, mapping)| (Some(from), mapping));
    let mapping = mapping.map(Arc::new);
    desk.logs.push(DeskLog {
        id,
        path,
        typed,
        role,
        choice,
        remembered,
        content,
        compared: None,
        again: false,
        stuck: None,
        guess: None,
        mapping,
    });
}

/// Where a model's file is, as one types it.
pub(super) fn file(path: &Path) -> Origin {
    Origin::File(as_typed(path).display().to_string())
}

/// Lays a model down and chooses it.
pub(super) fn lay_model(desk: &mut Desk, model: Model, origin: Origin) {
    let id = desk.fresh_id();
    desk.models.push(DeskModel { id, model, origin, shown: true, notes: Vec::new(), recipe: None });
    desk.chosen = id;
    desk.look_anew();
}

/// Lays down what a session had.
pub(super) fn lay_saved(desk: &mut Desk, places: &Places, saved: Saved) -> Result<(), WorkbenchError> {
    lay_saved_logs(desk, places, saved.logs);
    let chosen = lay_saved_models(desk, places, saved.models, saved.chosen_model);
    // A session of before said it by the name alone, which two may have.
    let by_name = || desk.models.iter().find(|it| it.model.name == saved.chosen).map(|it| it.id);
    if let Some(model) = chosen.or_else(by_name) {
        desk.chosen = model;
    }
    desk.models[0].shown = saved.shows_paper;
    desk.done = saved.done;
    for answer in saved.answers {
        if let Err(outdated) = kept::lay(desk, answer) {
            desk.notices.push(outdated.to_string());
        }
    }
    Ok(())
}

fn lay_saved_logs(desk: &mut Desk, places: &Places, logs: Vec<SavedLog>) {
    for log in logs {
        // A mapping that has no text here is one that is shipped: a session opens no other file.
        let is_known = |mapping: &DeskMapping| mapping.text.is_some() || mapping.is_shipped();
        match places.file(&log.path) {
            Ok(_) if !log.mapping.as_ref().is_none_or(is_known) => {
                let name = log.mapping.map(|mapping| mapping.name).unwrap_or_default();
                desk.notices.push(ActError::NoMapping(name).to_string());
            }
            Ok(path) => {
                let from = ReadFrom { sha256: log.sha256, bench: log.bench_sha256 };
                lay_log(desk, path, log.role, log.choice, Some((from, log.mapping)));
            }
            Err(error) => desk.notices.push(explained(&error)),
        }
    }
}

/// The model at this place of a session, by its number here.
fn lay_saved_models(
    desk: &mut Desk,
    places: &Places,
    models: Vec<SavedModel>,
    chosen_model: Option<usize>,
) -> Option<u64> {
    let mut chosen = None;
    for (at, SavedModel { file, sha256, model, shown }) in models.into_iter().enumerate() {
        let (model, origin) = match (file, model) {
            (Some(file), _) if file.as_os_str() == "paper" => {
                chosen = chosen.or((chosen_model == Some(at)).then_some(desk.models[0].id));
                continue;
            }
            // One that has gone does not take the rest of the session with it.
            (Some(file), _) => match open_model(places, &file) {
                Ok(model) => {
                    if sha256.is_some() && sha256 != kept::hash(&model) {
                        desk.notices.push(ChangedModel(file.display().to_string()).to_string());
                    }
                    (model, self::file(&file))
                }
                Err(error) => {
                    desk.notices.push(explained(&error));
                    continue;
                }
            },
            (None, Some(model)) => (model, Origin::Made),
            (None, None) => continue,
        };
        lay_model(desk, model, origin);
        if let Some(last) = desk.models.last_mut() {
            last.shown = shown;
            chosen = chosen.or((chosen_model == Some(at)).then_some(last.id));
        }
    }
    chosen
}

fn open_model(places: &Places, file: &Path) -> Result<Model, ActError> {
    Ok(session::open_model(&places.file(file)?)?)
}

/// Acts that take no time.
pub(super) fn lightly(desk: &mut Desk, act: Act) -> Result<(), ActError> {
    match act {
        Act::CloseLog { log } => {
            desk.log(log)?;
            desk.logs.retain(|it| it.id != log);
            desk.leave_log(log);
            desk.look_anew();
        }
        Act::OpenPart { log, part } => open_part(desk, log, part)?,
        Act::Role { log, role } => desk.log_mut(log)?.role = role,
        Act::Show { model, shown } => {
            desk.model_mut(model)?.shown = shown;
            desk.look_anew();
        }
        Act::Choose { model } => {
            keep(desk, model)?;
            desk.model_mut(model)?.shown = true;
            desk.chosen = model;
            desk.look_anew();
        }
        Act::CloseModel { model } => close_model(desk, model)?,
        Act::StepBack => step_back(desk)?,
        Act::Rung { steps } => rung(desk, steps)?,
        Act::Cancel => {
            if let Some(search) = desk.search.as_ref().filter(|search| search.state == SearchState::Running) {
                search.cancel.request();
            }
        }
        Act::Read => desk.notices.clear(),
        Act::Mend { log, column, signal, unit } => {
            guesses::mend(desk, log, (&column, &signal, unit.as_deref()))?;
        }
        Act::Confirm { log, like } => guesses::confirm(desk, log, like.as_deref())?,
        Act::AskAgain { log } => guesses::ask_again(desk, log)?,
        // Those that take time were seen to before.
        Act::OpenLog { .. }
        | Act::Reread { .. }
        | Act::OpenModel { .. }
        | Act::Identify
        | Act::Diagnose
        | Act::Discover
        | Act::AddLaw
        | Act::TryLaw
        | Act::Add { .. }
        | Act::Try { .. }
        | Act::Recalibrate => {}
    }
    Ok(())
}

/// What was opened becomes one of the logs of its file, by the name that a command would have.
fn open_part(desk: &mut Desk, id: u64, part: usize) -> Result<(), ActError> {
    let log = desk.log_mut(id)?;
    let is_there = matches!(&log.content, LogContent::Parts(parts) if parts.iter().any(|it| it.0 == part));
    if !is_there {
        return Err(ActError::NoPart(log.typed.clone(), part));
    }
    let mut named = std::mem::take(&mut log.path).into_os_string();
    named.push(format!("#{part}"));
    log.path = named.into();
    log.typed = log.path.display().to_string();
    log.content = LogContent::Opening;
    Ok(())
}

/// A tried model that is worked on stays, and the command that makes it is one of those done: what follows begins with its file.
pub(super) fn keep(desk: &mut Desk, id: u64) -> Result<(), ActError> {
    let model = desk.model(id)?;
    if model.origin != Origin::Tried {
        return Ok(());
    }
    // A law's is written by the command that found it.
    if let Some(recipe) = model.recipe.clone() {
        if (SearchInputs { model: recipe.of.model, ..SearchInputs::of(desk) }) != recipe.of {
            return Err(ActError::OtherLogs(model.model.name.clone()));
        }
        let (from, output) = (desk.model(recipe.of.model)?.typed(), model.typed());
        let command = by_hand::extend(desk, &from, &recipe.added, &output);
        desk.done.push(command);
    }
    desk.model_mut(id)?.origin = Origin::Made;
    Ok(())
}

fn close_model(desk: &mut Desk, model: u64) -> Result<(), ActError> {
    if desk.model(model)?.is_paper() {
        return Err(ActError::Paper);
    }
    if model == desk.chosen {
        return Err(ActError::Chosen);
    }
    desk.models.retain(|it| it.id != model);
    desk.look_anew();
    Ok(())
}

fn step_back(desk: &mut Desk) -> Result<(), ActError> {
    if desk.is_searching() {
        return Err(ActError::Busy);
    }
    let from = desk.model(desk.chosen)?;
    let (from_id, typed) = (from.id, from.typed());
    let mut back = session::step_back(&from.model)?;
    back.name = desk.fresh_name("step");
    let output = format!("{}.toml", back.name);
    desk.done.push(by_hand::step_back(&typed, &output));
    lay_model(desk, back, Origin::Made);
    let chosen = desk.chosen;
    desk.models.iter_mut().for_each(|model| model.shown = [from_id, chosen].contains(&model.id));
    Ok(())
}

/// Chooses the model as it was after so many steps: the one that is here, or the chosen one stepped back to there.
fn rung(desk: &mut Desk, steps: usize) -> Result<(), ActError> {
    let chosen = desk.model(desk.chosen)?;
    let (id, length) = (chosen.id, chosen.model.ladder.len());
    let gone = ActError::Gone { what: "rung", id: steps as u64 };
    let ladder = chosen.model.ladder.get(..steps).filter(|ladder| !ladder.is_empty()).ok_or(gone)?;
    let there = desk.models.iter().find(|it| it.model.ladder == ladder && it.origin != Origin::Tried);
    match there.map(|there| there.id) {
        Some(there) => {
            desk.chosen = there;
            desk.models.iter_mut().for_each(|it| it.shown = [id, there].contains(&it.id));
            desk.look_anew();
        }
        None => (steps..length).try_for_each(|_| step_back(desk))?,
    }
    Ok(())
}

/// Lays down the model with the law that was found: added, or to be looked at. The command that found it writes that model.
pub(super) fn lay_law(desk: &mut Desk, origin: Origin) -> Result<(), ActError> {
    if desk.is_searching() {
        return Err(ActError::Busy);
    }
    let current = SearchInputs::of(desk);
    let found = desk.discovered.as_ref().filter(|it| it.answered.of == current);
    let (model, notes) = found.and_then(|it| it.made.clone()).ok_or(ActError::NoLaw)?;
    let is_added = origin == Origin::Made;
    let there = desk.models.iter_mut().find(|it| it.model == model);
    let id = if let Some(there) = there {
        if is_added {
            there.origin = Origin::Made;
        }
        there.id
    } else {
        desk.models.retain(|it| it.origin != Origin::Tried || it.id == desk.chosen);
        let id = desk.fresh_id();
        desk.models.push(DeskModel { id, model, origin, shown: true, notes, recipe: None });
        id
    };
    let shown = [current.model, id];
    desk.models.iter_mut().for_each(|it| it.shown = shown.contains(&it.id));
    if is_added {
        desk.chosen = id;
    }
    desk.look_anew();
    Ok(())
}
