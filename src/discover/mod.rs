//! A law that no catalogue has: where it acts, its shape without a formula, and then a formula.
//!
//! The catalogue is asked first: what it explains is not discovered anew. Of a block that stays unexplained every place (a site and the
//! channels that a law may look at there) is tried with a smooth function, then the functions of a library. All of this is one step of
//! Gauss and Newton through the simulation; the best formulas are refitted by output error, and the held-out error decides.

pub mod answer;
pub(crate) mod assemble;
mod channels;
mod forms;
mod formula;
mod inner_numbers;
mod law;
mod linear;
mod lines;
mod measured_path;
mod places;
mod search;
mod shape;
pub mod thresholds;

use crate::diagnose::{DiagnoseConfig, DiagnoseError, SearchEvent, Verdict, diagnose_blocks};
use crate::model::Model;
use crate::screening::ScreenedLog;
use formula::LawTask;

pub use answer::{Discovery, LawVerdict};

/// Stem of the ids of laws that were found.
const ID: &str = "discovered_law";

/// Finds a law that the model is missing and the catalogue does not have; `progress` hears how far the search is.
///
/// # Errors
/// [`DiagnoseError`] when model and logs do not meet.
pub fn discover(
    model: &Model,
    train: &[ScreenedLog],
    validate: &[ScreenedLog],
    config: &DiagnoseConfig,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Result<Discovery, DiagnoseError> {
    let searched = diagnose_blocks(model, (train, validate), config, progress)?;
    let over = |index: &usize| {
        let found = &searched.found[*index];
        found.over_floor(&found.answer).0
    };
    let unknown = (0..searched.found.len()).filter(|index| searched.verdicts[*index] == Verdict::Unknown);
    let worst = unknown.max_by(|a, b| over(a).total_cmp(&over(b)));
    let Some(index) = worst.filter(|_| !searched.diagnosis.turns_against_torque) else {
        return Ok(assemble::of_catalogue(searched.diagnosis));
    };
    let known = model.known_effects()?;
    let id = free_id(model);
    let found = &searched.found[index];
    let task =
        LawTask { model, known: &known, found, start: &found.refitted, before: &found.refitted, id: &id };
    let hit = search::search(&task, progress);
    Ok(assemble::conclude(
        &task,
        searched.diagnosis,
        (&searched.found, &searched.verdicts, index),
        hit,
        config,
    ))
}

/// An id that the model does not have.
fn free_id(model: &Model) -> String {
    let numbered = (2..1000).map(|number| format!("{ID}_{number}"));
    let mut ids = std::iter::once(ID.to_owned()).chain(numbered);
    ids.find(|id| model.user_effect(id).is_none()).unwrap_or_else(|| ID.to_owned())
}
