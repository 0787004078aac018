//! How one process wakes another: a FIFO in the bench's directory, one for each process that waits.
//!
//! iceoryx2's events would do, but a notifier opens a listener that came back on the thread that notifies, which
//! allocates in a cycle. A FIFO has no such state: who comes back finds it as it was. Ringing a bell that nobody
//! answers costs one failed write once the FIFO is full.

use std::ffi::CString;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt;

use super::{BenchPlace, ShmError};

/// Whose bell it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Waiter {
    /// The controller: rung with each publication of sensors.
    Control,
    /// Who owns the guard, bridge or emulator: rung with each command and each request.
    Guard,
}

/// A wake-up line to one waiter.
#[derive(Debug)]
pub struct Bell {
    fifo: File,
}

impl Bell {
    /// Opens the bell of `waiter`, to ring it or to wait for it.
    #[allow(unsafe_code, reason = "std makes no FIFO")]
    pub(super) fn open(place: &BenchPlace, waiter: Waiter) -> Result<Self, ShmError> {
        let path = place.directory().join(match waiter {
            Waiter::Control => "wake-control",
            Waiter::Guard => "wake-guard",
        });
        let at = |error| ShmError::Place { path: path.clone(), error };
        let name = CString::new(path.as_os_str().as_bytes()).map_err(|error| at(error.into()))?;
        // SAFETY: `name` ends with a zero byte.
        if unsafe { libc::mkfifo(name.as_ptr(), 0o600) } != 0 {
            let error = io::Error::last_os_error();
            if error.kind() != io::ErrorKind::AlreadyExists {
                return Err(at(error));
            }
        }
        place.set_access()?;
        // Both ends at once: opening never waits for the other side, and its leaving is not an end of file.
        let fifo = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_NONBLOCK | libc::O_NOFOLLOW)
            .open(&path)
            .map_err(at)?;
        Ok(Self { fifo })
    }

    /// Wakes the waiter, whether it waits now or later. Never blocks.
    pub fn ring(&self) {
        // A full FIFO has been rung enough.
        let _ = (&self.fifo).write(&[0]);
    }

    /// Forgets all ringing so far.
    pub fn quiet(&self) {
        let mut rings = [0; 1024];
        while matches!((&self.fifo).read(&mut rings), Ok(count) if count == rings.len()) {}
    }

    /// For `ppoll`.
    #[must_use]
    pub fn descriptor(&self) -> RawFd {
        self.fifo.as_raw_fd()
    }
}
