//! How a process is asked to end: Ctrl-C, SIGTERM, a closed terminal, a panic on any of its threads. Ctrl-Z too: a
//! guard that is suspended leaves the rotors to the timeouts of their ESCs.
//!
//! None of them ends it at once. Each sets one flag, which the cycle sees within a period; the cycle then sends the
//! safe command and returns.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::cancel::Cancel;
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};

/// What the flag holds when a thread panicked.
const PANIC: usize = usize::MAX;
/// What it holds when the process had nothing left to do.
const DONE: usize = PANIC - 1;

/// The flag.
#[derive(Debug, Clone, Default)]
pub struct Shutdown {
    reason: Arc<AtomicUsize>,
}

impl Shutdown {
    /// Listens from now on.
    ///
    /// # Errors
    /// The operating system's.
    pub fn listen() -> io::Result<Self> {
        let shutdown = Self::default();
        for signal in [SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP] {
            // Whoever starts a bench with `nohup` wants it to outlive the terminal.
            if signal == SIGHUP && is_ignored(signal) {
                continue;
            }
            let number = usize::try_from(signal).unwrap_or(PANIC);
            signal_hook::flag::register_usize(signal, Arc::clone(&shutdown.reason), number)?;
        }
        let reason = Arc::clone(&shutdown.reason);
        let report = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            reason.store(PANIC, Ordering::Relaxed);
            report(panic);
        }));
        Ok(shutdown)
    }

    /// Whether the process is to end.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.reason.load(Ordering::Relaxed) != 0
    }

    /// Whether somebody or something from outside wants the end: a signal, a panic.
    #[must_use]
    pub fn is_interrupted(&self) -> bool {
        !matches!(self.reason.load(Ordering::Relaxed), 0 | DONE)
    }

    /// Asks for the end from inside, unless it was asked for before.
    pub fn request(&self) {
        let _ = self.reason.compare_exchange(0, DONE, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Why, in plain words.
    #[must_use]
    pub fn reason(&self) -> &'static str {
        let signal = i32::try_from(self.reason.load(Ordering::Relaxed));
        match signal {
            Ok(0) => "running",
            Ok(SIGINT) => "interrupted (Ctrl-C)",
            Ok(SIGTERM) => "asked to end (SIGTERM)",
            Ok(SIGHUP) => "the terminal was closed (SIGHUP)",
            Ok(SIGQUIT) => "asked to quit (SIGQUIT)",
            Ok(SIGTSTP) => "asked to pause (Ctrl-Z)",
            Err(_) if self.reason.load(Ordering::Relaxed) == PANIC => "a thread panicked",
            _ => "done",
        }
    }
}

/// Ctrl-C and SIGTERM cancel a computation from now on, which drives nothing; Ctrl-Z and the rest do what they always do.
///
/// # Errors
/// The operating system's.
pub fn cancel_on_signals() -> io::Result<Cancel> {
    let cancel = Cancel::default();
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, cancel.flag())?;
    }
    Ok(cancel)
}

fn is_ignored(signal: i32) -> bool {
    // SAFETY: a sigaction is plain data for which zero is valid; the call only writes it.
    let (code, action) = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        (libc::sigaction(signal, std::ptr::null(), &raw mut action), action)
    };
    code == 0 && action.sa_sigaction == libc::SIG_IGN
}
