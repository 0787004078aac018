//! Why there is no answer.

use std::io;
use std::path::PathBuf;

use crate::cancel::Cancelled;
use crate::session::SessionError;

/// Why a plan cannot be read, a shard cannot run, or answers cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// It was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A bench that cannot be diagnosed.
    #[error(transparent)]
    Session(SessionError),
    /// A file or a folder.
    #[error("{}: {error}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A plan that is none.
    #[error("{}: {reason}", path.display())]
    Plan {
        /// Which.
        path: PathBuf,
        /// What is wrong, and where.
        reason: String,
    },
    /// A file in the folder of answers that is none.
    #[error("{}: this is no answer of `fleet run`: {reason}; move it away, or give another folder", path.display())]
    Answer {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A shard that cannot be.
    #[error("`{0}` is no shard: it has to be I/N, such as 3/20, with I from 1 to N")]
    Shard(String),
    /// Folders without logs.
    #[error("`{pattern}`: no folder with logs; each bench is a folder that holds its logs")]
    NoBench {
        /// What was looked for.
        pattern: String,
    },
    /// An answer that cannot be written as JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

// By hand: the plan is to blame, not an option.
impl From<SessionError> for FleetError {
    fn from(error: SessionError) -> Self {
        Self::Session(error.of_plan())
    }
}

impl FleetError {
    /// What the system says of a file.
    pub(super) fn file(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        |error| Self::File { path, error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::csv;
    use crate::model::Model;

    #[test]
    fn an_error_about_a_bench_of_a_plan_names_the_key_of_the_plan() {
        let log = csv::parse(b"t,a\n0,1\n", "log.csv".as_ref()).expect_err("no time");
        let model = Model::parse("[[signal]]\n", "m.toml".as_ref()).expect_err("a mapping");
        for error in [SessionError::from(log), SessionError::from(model)] {
            let (before, behind) = (error.to_string(), FleetError::from(error).to_string());
            let key = "`mapping = \"FILE\"` of the bench in the plan";
            assert!(before.contains("`--mapping`") && behind.contains(key), "{before}, {behind}");
        }
    }
}
