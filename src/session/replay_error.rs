//! Why a recording cannot be replayed.

use std::path::PathBuf;

use crate::bench::BenchError;
use crate::model::ModelError;
use crate::recording::RecordError;
use crate::runtime::ProcessError;

/// Why a recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The bench file, recorded or given.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// The model, recorded or given.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The controller, the guard or the experiment.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// A setting that the bench file does not have.
    #[error("--set {assignment}: {reason}")]
    Set {
        /// What was given.
        assignment: String,
        /// What is wrong.
        reason: SetError,
    },
    /// A bench that cannot be written as TOML.
    #[error(transparent)]
    Emit(#[from] toml::ser::Error),
    /// What was written of it, read again.
    #[error(transparent)]
    Parse(#[from] toml::de::Error),
    /// A recording whose experiment does not parse.
    #[error("{}: experiment.toml: {}", recording.display(), error.message())]
    Experiment {
        /// The recording.
        recording: PathBuf,
        /// Where and why.
        error: toml::de::Error,
    },
    /// A recording without a step.
    #[error("{}: it holds no step of a controller or guard to replay", recording.display())]
    Nothing {
        /// The recording.
        recording: PathBuf,
    },
}

/// What is wrong with an assignment to a key of the bench file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SetError {
    /// No equals sign.
    #[error("write KEY=VALUE")]
    Form,
    /// No value of TOML.
    #[error("the value is not one of TOML (text needs quotes)")]
    Value,
    /// A key that is not there.
    #[error("the bench file has no `{key}` there")]
    NoKey {
        /// The key.
        key: String,
    },
    /// A key below one that is no table.
    #[error("`{key}` is not a table")]
    NoTable {
        /// The key.
        key: String,
    },
    /// No key.
    #[error("the key is empty")]
    Empty,
}
