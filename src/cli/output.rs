//! Where results go: never over what the command reads, never two to one place, and over a file that is there already only
//! with `--force`. One rule for all commands.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::CliError;
use super::usage_error::UsageError;
use crate::file::{check_place, is_there};
use crate::report::json;
use crate::report::notes::Detail;

/// Prints what a command found: its answer as JSON, or its text, which ends its last line itself.
pub(super) fn say<T: Serialize>(
    as_json: bool,
    answer: &T,
    text: impl FnOnce() -> String,
) -> Result<(), CliError> {
    if as_json {
        println!("{}", json::answer(answer)?);
    } else {
        print!("{}", text());
    }
    Ok(())
}

/// The option of every command that writes files.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct Force {
    /// Replace files that are there already; without it they are refused
    #[arg(long)]
    force: bool,
}

/// How much of the notes about logs a command says.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct NotesArgument {
    /// Say what a short answer leaves out: each note about each log, each reason
    #[arg(long)]
    notes: bool,
}

impl NotesArgument {
    pub(super) fn detail(self) -> Detail {
        if self.notes { Detail::Every } else { Detail::Short }
    }
}

/// How a command answers that writes a page with the whole story, too.
#[derive(Debug, clap::Args)]
pub struct AnswerArguments {
    #[command(flatten)]
    pub(super) force: Force,
    /// Answer as JSON on standard output
    #[arg(long)]
    pub(super) json: bool,
    /// Write a page with the whole story (HTML)
    #[arg(long, value_name = "FILE")]
    pub(super) report: Option<PathBuf>,
}

impl Force {
    /// Refuses what is there already, unless it may be replaced.
    pub(super) fn check<'a>(self, results: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), UsageError> {
        let there = results.into_iter().find(|path| !self.force && is_there(path));
        there.map_or(Ok(()), |path| Err(UsageError::IsThere { path: path.clone() }))
    }

    /// Makes way for a recording, which is written where it stays and not beside it: takes away what may be replaced.
    pub(super) fn make_way(self, recording: &Path) -> Result<(), UsageError> {
        self.check([&recording.to_owned()])?;
        if self.force && is_there(recording) {
            std::fs::remove_file(recording).map_err(UsageError::at(recording))?;
        }
        Ok(())
    }
}

/// Refuses, before the work whose results they are for, files that could not be written, that the command reads, that
/// are one and the same, or that are there already.
pub(super) fn writable<'a>(
    results: impl IntoIterator<Item = &'a PathBuf>,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    force: Force,
) -> Result<(), UsageError> {
    let inputs: Vec<PathBuf> = inputs.into_iter().map(|path| place(path)).collect();
    let mut taken = Vec::new();
    for path in results {
        let place = place(path);
        if inputs.contains(&place) {
            return Err(UsageError::IsInput { path: path.clone() });
        }
        if taken.contains(&place) {
            return Err(UsageError::TwoResults { path: path.clone() });
        }
        check_place(path).map_err(UsageError::at(path))?;
        force.check([path])?;
        taken.push(place);
    }
    Ok(())
}

/// One name for each file, however its path is written.
fn place(path: &Path) -> PathBuf {
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Some(folder.unwrap_or(Path::new(".")).canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_folder).unwrap_or_else(|| path.to_owned())
}
