//! Work that may be cancelled, fail, or fail by a mistake of the program's own: none of it ends the server.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::error::Broken;
use crate::report::findings::explained;
use crate::session::SessionError;

/// Why work has no result.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Ended {
    Cancelled,
    Failed(String),
}

/// Does the work, whatever becomes of it.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T, SessionError>) -> Result<T, Ended> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(SessionError::Cancelled(_))) => Err(Ended::Cancelled),
        Ok(Err(error)) => Err(Ended::Failed(explained(&error))),
        Err(_) => Err(Ended::Failed(Broken.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancelled;

    #[test]
    fn a_panic_of_a_job_is_said_and_ends_nothing() {
        let failed = guarded::<()>(|| std::panic::resume_unwind(Box::new("a mistake of the program's own")));
        assert_eq!(failed, Err(Ended::Failed(Broken.to_string())));
        assert_eq!(guarded::<()>(|| Err(Cancelled.into())), Err(Ended::Cancelled));
        assert_eq!(guarded(|| Ok(1)), Ok(1));
    }
}
