//! How a command ended: done, found wanting, or an error with its place.

use std::error::Error;
use std::fmt;
use std::path::Path;

use super::place::Setting;
use crate::cancel::Cancelled;
use crate::report::findings::explained;
use crate::session::SessionError;

/// How a command ended when nothing was wrong with its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Exit 0.
    Done,
    /// Exit 1: it worked, and what it looked at was found wanting.
    FoundWanting,
}

/// Bad usage or bad input: exit 2, one clear sentence with the place.
#[derive(Debug)]
pub struct CliError {
    sentence: String,
    /// What of the bench file it speaks of, where it does not yet say in which file that is.
    setting: Option<Setting>,
    /// The user did not want to wait: exit 1, and no error.
    pub(super) is_cancelled: bool,
}

impl CliError {
    /// An error that says `sentence`.
    pub fn new(sentence: impl Into<String>) -> Self {
        Self { sentence: sentence.into(), setting: None, is_cancelled: false }
    }

    /// The same with its place in the bench file at `path`, with the content `text`, where it speaks of that.
    pub(super) fn in_bench_file(self, path: &Path, text: &str) -> Self {
        match self.setting.and_then(|setting| setting.place(path, text)) {
            Some(place) => Self::new(format!("{place}: {}", self.sentence)),
            None => Self::new(self.sentence),
        }
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.sentence)
    }
}

// `CliError` does not implement `Error`, so that every room's error converts with `?`, causes included.
impl<E: std::error::Error + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        let setting = Setting::of(&error);
        let is_cancelled = is_cancelled(&error);
        let sentence = explained(&error);
        Self { sentence, setting, is_cancelled }
    }
}

/// What every subcommand's `run` answers.
pub type CliResult = Result<Outcome, CliError>;

/// Whether an error is the end of work that was cancelled.
fn is_cancelled(error: &(dyn Error + 'static)) -> bool {
    error.is::<Cancelled>() || matches!(error.downcast_ref(), Some(SessionError::Cancelled(_)))
}
