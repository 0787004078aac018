//! Why the run of the paper failed.

use crate::guard::Cause;
use crate::identify::IdentifyError;
use crate::log::DatasetError;
use crate::runtime::ProcessError;

/// Why the run failed.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// The emulated bench, an experiment or a controller cannot be built.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// The guard stopped the rotors.
    #[error("{what}: the guard stopped the rotors after {time_s:.2} s: {cause}")]
    Stopped {
        /// Which experiment or run.
        what: String,
        /// [s] of virtual time since the bench began.
        time_s: f64,
        /// Why.
        cause: Cause,
    },
    /// The operator wanted to stop.
    #[error("stopped in the middle of {what}: {reason}")]
    Interrupted {
        /// Which experiment or run.
        what: String,
        /// What ended it.
        reason: &'static str,
    },
    /// A controller refuses.
    #[error(transparent)]
    Control(#[from] crate::control::ControlError),
    /// A log is none.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Identification fails.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}
