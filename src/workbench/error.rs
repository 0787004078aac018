//! Why the workbench does not open, or does not do what the page asks.

use std::io;
use std::path::PathBuf;

use super::places::PlaceError;
use crate::log::csv::LogError;
use crate::session::SessionError;

/// Why the workbench does not open.
#[derive(Debug, thiserror::Error)]
pub enum WorkbenchError {
    /// The port is taken, or not to be had.
    #[error("port {port} of 127.0.0.1 (`--port 0` takes any that is free)")]
    Port {
        /// The port.
        port: u16,
        /// What the system says.
        source: io::Error,
    },
    /// The demonstration's logs find no room.
    #[error(
        "the demonstration's logs cannot be written to {path} here: start it in a folder of yours, or name logs"
    )]
    Demo {
        /// Where they go.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The operating system refuses.
    #[error("the workbench's server")]
    System(#[source] io::Error),
    /// A file or folder that was named.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// A session file that cannot be read.
    #[error("session file {path}: {reason}")]
    Saved {
        /// The file.
        path: PathBuf,
        /// Line, column and reason, or what the system says.
        reason: String,
    },
    /// A model that cannot be opened, or the demonstration's flight.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The demonstration's log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// Why an act is refused.
#[derive(Debug, thiserror::Error)]
pub enum ActError {
    /// A log or model that is no longer on the workbench.
    #[error("{what} {id} is no longer on the workbench")]
    Gone {
        /// `log` or `model`.
        what: &'static str,
        /// Its number.
        id: u64,
    },
    /// A search is running.
    #[error("a search is running: cancel it, or wait for its end")]
    Busy,
    /// A log that is still being read.
    #[error("{0} is still being read")]
    Opening(String),
    /// A foreign log whose columns nobody has confirmed.
    #[error("{0}: what its columns mean is a guess yet: confirm it first")]
    Guessed(String),
    /// A file with several logs, of which none was chosen.
    #[error("{0} holds several logs: choose one first")]
    Several(String),
    /// A log that the file does not hold, or that nobody asks for.
    #[error("{0}: there is no part {1} to be chosen")]
    NoPart(String, usize),
    /// Logs of which different parts count by the same command.
    #[error(
        "of {0} and {1} different rotors or times were chosen, and a command takes one choice for all of its logs"
    )]
    Choices(String, String),
    /// A model of chosen rotors alone.
    #[error(
        "{0}: rotors were chosen, and a model of the bench names them as the log does: open it with all of them"
    )]
    ChosenRotors(String),
    /// A log whose columns nobody asks for.
    #[error("{0}: it says itself what its columns mean, or they are confirmed")]
    NotAsked(String),
    /// A mapping that is not here, or not for these columns.
    #[error("no mapping `{0}` is here that fits these columns")]
    NoMapping(String),
    /// No column is said to be the time.
    #[error("{0}: none of its columns is said to be the time (`time_s`)")]
    NoTime(String),
    /// A mapping that has no text.
    #[error("the mapping cannot be written: {0}")]
    Spelling(String),
    /// Logs whose columns mean different things by the same command.
    #[error(
        "{0} and {1} are read by different mappings, and a command takes one for all of its logs: press `its columns ...` \
         of one and read it by the mapping of the other, or choose `look` for it"
    )]
    Mappings(String, String),
    /// No log to fit on.
    #[error("no log to fit on: choose `fit` for one of the logs")]
    NoLog,
    /// A file outside of what was named.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// What the session says.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Nothing was asked that there is to export.
    #[error("there is nothing to export yet: {0}")]
    Nothing(&'static str),
    /// A law of another model, or of other logs.
    #[error("no law was found of the chosen model by these logs: look for it again")]
    NoLaw,
    /// The one that every desk has.
    #[error("the paper's model stays: take its curves away instead")]
    Paper,
    /// A tried model whose command would read other logs now.
    #[error("{0} was tried by other logs: add its effects again")]
    OtherLogs(String),
    /// The one that everything starts from.
    #[error("the model that is chosen stays: choose another one first")]
    Chosen,
}

/// A job that ended by a mistake of the program's own.
#[derive(Debug, thiserror::Error)]
#[error(
    "the program itself failed here; what was open is still there (its standard error says where: please report it)"
)]
pub(super) struct Broken;

/// A log that is no longer what a session remembers.
#[derive(Debug, thiserror::Error)]
#[error("{0} has changed since the session was saved: what was found of it then was found of other rows")]
pub(super) struct Changed(pub String);

/// A capture whose frames are said otherwise than a session remembers.
#[derive(Debug, thiserror::Error)]
#[error("{log} is read by {bench} now, and the bench file said otherwise when the session was saved")]
pub(super) struct OtherBench {
    pub log: String,
    pub bench: String,
}

/// A bench file of a session that cannot be read any more.
#[derive(Debug, thiserror::Error)]
#[error(
    "the bench file of the session cannot be read ({why}): captures, margins and the live view are those of the built-in bench"
)]
pub(super) struct LostBench {
    pub file: PathBuf,
    pub why: String,
}

/// A session whose commands name files from another folder.
#[derive(Debug, thiserror::Error)]
pub(super) enum OtherFolder {
    /// Where everything is named from now on.
    #[error("the commands of this session are typed in {0}")]
    There(String),
    /// It is not there any more.
    #[error(
        "the commands of this session were typed in {0}, which is not there any more: they name their files from it"
    )]
    Gone(String),
}

/// A log that was read and is a file of another kind now.
#[derive(Debug, thiserror::Error)]
#[error("its columns are others now; what was read before is shown")]
pub(super) struct OtherColumns;

/// A model that is no longer what a session remembers.
#[derive(Debug, thiserror::Error)]
#[error(
    "the model {0} has changed since the session was saved: what is drawn and fitted now is of the model as it is"
)]
pub(super) struct ChangedModel(pub String);

/// An answer that a session kept, and that is not shown again.
#[derive(Debug, thiserror::Error)]
pub(super) enum Outdated {
    /// A log or a model that is another now.
    #[error("what `{search}` had said is left out: {file} is not what it was then; ask again")]
    File {
        /// The command that answers so.
        search: &'static str,
        /// The log, or the model's name.
        file: String,
    },
    /// Another program said it.
    #[error("what `{search}` had said is left out: version {version} of the program said it; ask again")]
    Program {
        /// The command that answers so.
        search: &'static str,
        /// Of the program.
        version: String,
    },
    /// Somebody has written in it.
    #[error("what `{search}` had said is left out: its text in the session was changed; ask again")]
    Text {
        /// The command that answers so.
        search: &'static str,
    },
}
