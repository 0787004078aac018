//! The wish to end a long computation, and how it is heard deep inside one.
//!
//! A search is thousands of fits, deep in functions that cannot fail. Whoever starts one runs it with [`Cancel::run`]; inside,
//! [`check`] leaves the whole computation as soon as the token is set, by unwinding without a panic: no hook is called and
//! nothing is printed. Threads that the computation starts take the token along with [`Cancel::during`]. Where nobody started
//! the work with a token, [`check`] does nothing.
//!
//! ```
//! use rotorbench::cancel::{Cancel, Cancelled, check};
//!
//! let cancel = Cancel::default();
//! assert_eq!(cancel.run(|| 1 + 1), Ok(2));
//! let asked = cancel.clone();
//! let endless = || loop {
//!     asked.request();
//!     check();
//! };
//! assert_eq!(cancel.run::<()>(endless), Err(Cancelled));
//! ```

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The token; its copies are one and the same.
///
/// ```
/// use rotorbench::cancel::{Cancel, Cancelled};
///
/// let cancel = Cancel::default();
/// assert_eq!(cancel.run(|| 42), Ok(42));
/// cancel.clone().request();
/// assert_eq!(cancel.run(|| 42), Err(Cancelled));
/// ```
#[derive(Debug, Clone, Default)]
pub struct Cancel {
    flag: Arc<AtomicBool>,
}

/// The work was cancelled before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled; nothing was written")]
pub struct Cancelled;

thread_local! {
    /// The token of the work that this thread does.
    static CURRENT: RefCell<Option<Cancel>> = const { RefCell::new(None) };
}

impl Cancel {
    /// Asks for the end.
    pub fn request(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }

    /// Whether the end was asked for.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// The flag itself, for who can only set one, as a signal's handler.
    #[must_use]
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.flag)
    }

    /// Does the work, and ends it early when that is asked for.
    ///
    /// # Errors
    /// [`Cancelled`] when it was asked for, also in the last moment.
    pub fn run<T>(&self, work: impl FnOnce() -> T) -> Result<T, Cancelled> {
        // What the work had begun is dropped with it; what it only reads stays whole.
        let ended = catch_unwind(AssertUnwindSafe(|| self.during(work)));
        match ended {
            Ok(_) if self.is_requested() => Err(Cancelled),
            Ok(done) => Ok(done),
            Err(reason) if reason.is::<Cancelled>() => Err(Cancelled),
            Err(panic) => resume_unwind(panic),
        }
    }

    /// The token of the work that this thread does; one that nobody sets where it does none.
    #[must_use]
    pub fn current() -> Self {
        CURRENT.with_borrow(|current| current.clone().unwrap_or_default())
    }

    /// Makes [`check`] look at this token while `work` is done on this thread.
    pub fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        let before = CURRENT.replace(Some(self.clone()));
        let _restore = Restore(before);
        work()
    }
}

/// Puts a thread's token back, also when the work is left by unwinding.
struct Restore(Option<Cancel>);

impl Drop for Restore {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

/// Leaves the computation when its end was asked for. Cheap enough for every step of a fit and every stretch of a log.
pub fn check() {
    if CURRENT.with_borrow(|current| current.as_ref().is_some_and(Cancel::is_requested)) {
        resume_unwind(Box::new(Cancelled));
    }
}

/// The same at one row in some thousands, for what goes through a whole log: it costs nothing beside so many.
pub fn check_at(row: usize) {
    const ROWS: usize = 4096;
    if row.is_multiple_of(ROWS) {
        check();
    }
}

/// Whether the work is left within itself, once its end was asked for: [`Cancel::run`] says so of any that ends, too.
#[cfg(test)]
pub(crate) fn is_left_within<T>(work: impl FnOnce() -> T) -> bool {
    let cancel = Cancel::default();
    cancel.request();
    let mut is_through = false;
    let _ = cancel.run(|| {
        work();
        is_through = true;
    });
    !is_through
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_work_with_the_token_is_left() {
        let (outer, inner) = (Cancel::default(), Cancel::default());
        inner.request();
        let left = outer.run(|| {
            let left = inner.run(check);
            check();
            left
        });
        assert_eq!(left, Ok(Err(Cancelled)));
        check();
    }

    #[test]
    fn an_end_in_the_last_moment_counts() {
        let cancel = Cancel::default();
        assert_eq!(cancel.run(|| cancel.request()), Err(Cancelled));
    }

    #[test]
    fn a_panic_stays_a_panic() {
        let cancel = Cancel::default();
        let caught = catch_unwind(AssertUnwindSafe(|| cancel.run(|| resume_unwind(Box::new("broken")))));
        assert!(caught.is_err());
    }
}
