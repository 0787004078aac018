//! Work that is watched and may be cancelled.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::error::SessionError;
use crate::cancel::Cancel;
use crate::diagnose::SearchEvent;

/// What is reported of long work.
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
    /// These effects were fitted to the end.
    Tried {
        /// Ids.
        effects: &'a [String],
        /// [-] rms of the held-out residual over the noise's.
        over_noise: f64,
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
/// let show = |progress: Progress| {
///     if let Progress::Leading { effects } = progress {
///         eprintln!("in the lead: {}", effects.join(", "));
///     }
/// };
/// let job = Job::new(&cancel, &show); // for `session::diagnose` and its like; `cancel.request()` ends them
/// ```
#[derive(Clone, Copy)]
pub struct Job<'a> {
    cancel: &'a Cancel,
    progress: &'a (dyn Fn(Progress) + Sync),
}

impl<'a> Job<'a> {
    /// Work that `cancel` ends, and that reports to `progress` how far it is.
    #[must_use]
    pub fn new(cancel: &'a Cancel, progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { cancel, progress }
    }

    /// Work that `cancel` ends, and that nobody watches.
    #[must_use]
    pub fn unwatched(cancel: &'a Cancel) -> Self {
        Self { cancel, progress: &|_| () }
    }

    pub(super) fn report(&self, progress: Progress) {
        (self.progress)(progress);
    }

    /// Hears what a search comes to, and reports it.
    pub(super) fn hear(&self) -> impl Fn(SearchEvent) + Sync + '_ {
        let fitted = AtomicUsize::new(0);
        move |event| match event {
            SearchEvent::Fitted => {
                self.report(Progress::Candidate { fitted: 1 + fitted.fetch_add(1, Ordering::Relaxed) })
            }
            SearchEvent::Tried { effects, over_noise } => {
                self.report(Progress::Tried { effects, over_noise })
            }
            SearchEvent::Leading(effects) => self.report(Progress::Leading { effects }),
        }
    }

    /// Does the work until it ends or is cancelled.
    pub(super) fn run<T, E>(&self, work: impl FnOnce() -> Result<T, E>) -> Result<T, SessionError>
    where
        SessionError: From<E>,
    {
        Ok(self.cancel.run(work)??)
    }
}
