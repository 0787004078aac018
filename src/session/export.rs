//! A recording, written for other programs.

use std::path::Path;

use super::SessionError;
use crate::log::export::{self, ExportSummary};

/// What of a recording is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportPart {
    /// A CSV log: one row for each period of the guard.
    Rows,
    /// The raw frames, as `candump -L` writes them.
    Frames,
}

/// Writes a part of `recording` to `output`, whose file appears whole or not at all.
///
/// # Errors
/// [`SessionError::Record`] when the recording cannot be read, holds no period of the guard, or the file cannot be written.
pub fn export(recording: &Path, part: ExportPart, output: &Path) -> Result<ExportSummary, SessionError> {
    Ok(match part {
        ExportPart::Rows => export::write_log(recording, output)?,
        ExportPart::Frames => export::write_candump(recording, output)?,
    })
}
