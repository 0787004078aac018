//! Long work on a command line: it ends with Ctrl-C or SIGTERM, and what is written is written after it.

use std::sync::{Mutex, PoisonError};

use super::CliError;
use super::progress::ProgressLine;
use crate::cancel::Cancel;
use crate::report::findings::step;
use crate::rt::cancel_on_signals;
use crate::session::{Job, Progress};

/// Does the work of a command up to its results; from its beginning on signals cancel it. What it writes has to be written
/// behind it.
pub(super) fn cancellable<T>(work: impl FnOnce(&Cancel) -> Result<T, CliError>) -> Result<T, CliError> {
    let cancel = cancel_on_signals()?;
    cancel.run(|| work(&cancel))?
}

/// Does work in named steps, with a bar.
pub(super) fn in_steps<T>(cancel: &Cancel, work: impl FnOnce(&Job) -> T) -> T {
    let line = ProgressLine::start();
    work(&Job::new(cancel, &|progress| {
        if let Progress::Step { name, of, .. } = progress {
            line.step(step(name), of);
        }
    }))
}

/// Does a search, with a count of its candidates and the set in the lead.
pub(super) fn searching<T>(cancel: &Cancel, work: impl FnOnce(&Job) -> T) -> T {
    let line = ProgressLine::start();
    let leading = Mutex::new(String::new());
    work(&Job::new(cancel, &|progress| match progress {
        Progress::Candidate { .. } => {
            let leading = leading.lock().unwrap_or_else(PoisonError::into_inner);
            line.one_more(&format!("candidates fitted{leading}"));
        }
        Progress::Leading { effects } => {
            let mut leading = leading.lock().unwrap_or_else(PoisonError::into_inner);
            *leading = format!(", leading: {}", effects.join(" + "));
        }
        Progress::Tried { .. } | Progress::Step { .. } => {}
    }))
}
