//! How a command ended: done, found wanting, or an error with its place.

use std::error::Error;
use std::fmt;
use std::path::Path;

use super::place::Setting;
use super::usage_error::UsageError;
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
pub enum CliError {
    /// What the command itself refuses.
    Usage(UsageError),
    /// What a room refuses.
    Room {
        /// Its error.
        error: Box<dyn Error + Send + Sync>,
        /// What of the bench file it speaks of, where it does not say in which file that is.
        setting: Option<Setting>,
        /// Where that stands: file and line.
        place: Option<String>,
    },
    /// The user did not want to wait: exit 1, and no error.
    Cancelled(Box<dyn Error + Send + Sync>),
}

impl CliError {
    /// The same with its place in the bench file at `path`, with the content `text`, where it speaks of that.
    pub(super) fn in_bench_file(self, path: &Path, text: &str) -> Self {
        match self {
            Self::Room { error, setting, place } => {
                let place = setting.as_ref().and_then(|setting| setting.place(path, text)).or(place);
                Self::Room { error, setting, place }
            }
            other => other,
        }
    }

    /// The same about what an option says in the place of the bench file, which is not to blame then.
    pub(super) fn of_option(self, option: &str, value: impl fmt::Display) -> Self {
        match self {
            Self::Room { error, setting: Some(_), .. } => {
                Self::Room { error, setting: None, place: Some(format!("{option} {value}")) }
            }
            other => other,
        }
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(error) => formatter.write_str(&explained(error)),
            Self::Room { error, place: Some(place), .. } => {
                write!(formatter, "{place}: {}", explained(&**error))
            }
            Self::Room { error, .. } | Self::Cancelled(error) => formatter.write_str(&explained(&**error)),
        }
    }
}

// `CliError` does not implement `Error`, so that every room's error converts with `?`, causes included.
impl<E: Error + Send + Sync + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        let (setting, is_cancelled) = (Setting::of(&error), is_cancelled(&error));
        let error: Box<dyn Error + Send + Sync> = Box::new(error);
        match error.downcast::<UsageError>() {
            Ok(usage) => Self::Usage(*usage),
            Err(error) if is_cancelled => Self::Cancelled(error),
            Err(error) => Self::Room { error, setting, place: None },
        }
    }
}

/// What every subcommand's `run` answers.
pub type CliResult = Result<Outcome, CliError>;

/// Whether an error is the end of work that was cancelled.
fn is_cancelled(error: &(dyn Error + 'static)) -> bool {
    error.is::<Cancelled>() || matches!(error.downcast_ref(), Some(SessionError::Cancelled(_)))
}
