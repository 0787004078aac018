//! Why nothing could be identified.

use super::result::PipelineStep;
use super::steady_rows::HIGHEST_DEGREE;
use crate::screening::{Finding, ScreeningError};

/// Why nothing could be identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// No log was given.
    #[error("no log to identify from")]
    NoLog,
    /// The logs permit none of the steps.
    #[error("nothing can be identified")]
    Nothing {
        /// What is wrong with the logs: first why those that have no part have none.
        reasons: Vec<Finding>,
        /// What each step lacks; none where there is no rotor.
        steps: Vec<PipelineStep>,
    },
    /// A log that cannot be used.
    #[error(transparent)]
    Screening(#[from] ScreeningError),
    /// A setting outside its range.
    #[error("the degree of g(u) must lie in 1..{HIGHEST_DEGREE}, not {0}")]
    Degree(usize),
}
