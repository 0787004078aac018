//! What a person does with logs and models: open, compare, identify, diagnose, extend, step back, save; and what a bench file
//! and a machine are good for.
//!
//! Each function takes what it works on and a [`Job`], which hears of progress and may be cancelled, and returns a result,
//! never text: `report` makes text of it, and the command line and every other surface are shells around both.
//!
//! A first result in ten lines stands on the [front page](crate#a-first-result); whole programs are `examples/read_log.rs`,
//! `examples/compare.rs`, `examples/diagnose.rs` and `examples/own_effect.rs`.

mod bench_check;
mod compare;
mod diagnose;
mod dronecan_nodes;
mod emulated_run;
mod extend;
mod guess;
mod identify;
mod machine;
mod modelled;
mod models;
mod open;
mod rotors;
pub mod thresholds;

use crate::bench::BenchError;
use crate::can::CanError;
use crate::cancel::{Cancel, Cancelled};
use crate::compare::CompareError;
use crate::diagnose::DiagnoseError;
use crate::identify::IdentifyError;
use crate::log::ForeignError;
use crate::log::can_capture::CaptureError;
use crate::log::csv::LogError;
use crate::log::format::FormatError;
use crate::log::mapping::MappingError;
use crate::model::ModelError;
use crate::recording::RecordError;
use crate::runtime::ProcessError;

pub use bench_check::{BenchCheck, InterfaceLook};
pub use compare::{compare, compare_extension};
pub use diagnose::diagnose;
pub use dronecan_nodes::dronecan_nodes;
pub use emulated_run::run_emulated;
#[doc(hidden)]
pub use emulated_run::run_emulated as fly;
pub use extend::{Extended, extend, refit};
pub use guess::{GuessedLog, guess_columns};
pub use identify::identify;
pub use machine::{Grade, MachineCheck, check_machine};
pub use models::{name_after, open_model, save_model, step_back};
pub use open::{ChoiceError, OpenConfig, Opened, between, open, open_all, rotors};
pub use rotors::{diagnose_each, many_rotors};

/// What is heard of long work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress<'a> {
    /// A step begins.
    Step {
        /// Its name.
        name: &'a str,
        /// Its number, from 1.
        number: usize,
        /// How many there are.
        of: usize,
    },
    /// Another candidate was fitted.
    Candidate {
        /// How many were.
        fitted: usize,
    },
    /// A set of effects is in the lead.
    Leading {
        /// Ids.
        effects: &'a [String],
    },
}

/// Work that is watched and may be cancelled.
///
/// ```
/// use rotorbench::{cancel::Cancel, session::{Job, Progress}};
///
/// let cancel = Cancel::default();
/// let hear = |progress: Progress| {
///     if let Progress::Leading { effects } = progress {
///         eprintln!("in the lead: {}", effects.join(", "));
///     }
/// };
/// let job = Job::new(&cancel, &hear); // for `session::diagnose` and its like; `cancel.request()` ends them
/// ```
#[derive(Clone, Copy)]
pub struct Job<'a> {
    cancel: &'a Cancel,
    progress: &'a (dyn Fn(Progress) + Sync),
}

impl<'a> Job<'a> {
    /// Work that `cancel` ends, and that tells `progress` how far it is.
    #[must_use]
    pub fn new(cancel: &'a Cancel, progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { cancel, progress }
    }

    /// Work that `cancel` ends, and that nobody watches.
    #[must_use]
    pub fn unwatched(cancel: &'a Cancel) -> Self {
        Self { cancel, progress: &|_| () }
    }

    fn tell(&self, progress: Progress) {
        (self.progress)(progress);
    }

    /// Does the work until it ends or is cancelled.
    fn run<T, E>(&self, work: impl FnOnce() -> Result<T, E>) -> Result<T, SessionError>
    where
        SessionError: From<E>,
    {
        Ok(self.cancel.run(work)??)
    }
}

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// It was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A log in our format.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A log in a format of another program.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A part of a log that is not there.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// A foreign log.
    #[error(transparent)]
    Foreign(#[from] ForeignError),
    /// The mapping of a foreign log.
    #[error(transparent)]
    Mapping(#[from] MappingError),
    /// A recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A capture of a bus.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The bench file that says what a capture's frames mean.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// Its roles.
    #[error(transparent)]
    Can(#[from] CanError),
    /// A model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Nothing could be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Nothing could be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Nothing could be diagnosed or extended.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// A run on the emulated bench.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// There is no step to undo.
    #[error("the ladder is empty, there is no step to undo")]
    EmptyLadder,
}
