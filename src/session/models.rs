//! Models: opened, saved, a step of their ladder undone.

use std::path::Path;

use super::SessionError;
use crate::model::Model;

/// Opens a model file; `paper` is the paper's model.
///
/// # Errors
/// The file, or what stands in it.
pub fn open_model(path: &Path) -> Result<Model, SessionError> {
    Ok(Model::load(path)?)
}

/// Saves a model: its file appears whole or not at all.
///
/// # Errors
/// What the system says.
pub fn save_model(model: &Model, path: &Path) -> Result<(), SessionError> {
    Ok(model.save(path)?)
}

/// The model without the last step of its ladder.
///
/// # Errors
/// [`SessionError::EmptyLadder`].
pub fn step_back(model: &Model) -> Result<Model, SessionError> {
    model.step_back().ok_or(SessionError::EmptyLadder)
}

/// Names a model after the file it goes to: side by side with the model it came from it has to have a name of its own.
pub fn name_after(model: &mut Model, file: &Path) {
    if let Some(stem) = file.file_stem() {
        model.name = stem.to_string_lossy().into_owned();
    }
}
