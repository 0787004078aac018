//! How a process is asked to end: by any signal that can be caught, and by a panic on any of its threads but those that only
//! write something down. Ctrl-Z is one of
//! them: a guard that is suspended leaves the rotors to the timeouts of their ESCs.
//!
//! None of them ends it at once. Each sets one flag, which the cycle sees within a period; the cycle then sends the
//! safe command and returns. What cannot be caught is in `docs/guide/guard.md`.

use std::cell::Cell;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use libc::{c_int, siginfo_t};

use super::fault;
use crate::cancel::Cancel;

/// What the flag holds when a thread panicked.
const PANIC: usize = usize::MAX;
/// What it holds when the process had nothing left to do.
const DONE: usize = PANIC - 1;

/// The signals that would end or suspend a process, and what each of them says. Those of the processor are in `fault.rs`, those
/// of real time are all the numbers behind.
const ENDS: [(c_int, &str); 19] = [
    (libc::SIGINT, "interrupted (Ctrl-C)"),
    (libc::SIGTERM, "asked to end (SIGTERM)"),
    (libc::SIGHUP, "the terminal was closed (SIGHUP)"),
    (libc::SIGQUIT, "asked to quit (SIGQUIT)"),
    (libc::SIGTSTP, "asked to pause (Ctrl-Z)"),
    (libc::SIGABRT, "asked to abort (SIGABRT)"),
    (libc::SIGUSR1, "asked to end (SIGUSR1)"),
    (libc::SIGUSR2, "asked to end (SIGUSR2)"),
    (libc::SIGPIPE, "asked to end (SIGPIPE)"),
    (libc::SIGALRM, "asked to end (SIGALRM)"),
    (libc::SIGVTALRM, "asked to end (SIGVTALRM)"),
    (libc::SIGPROF, "asked to end (SIGPROF)"),
    (libc::SIGIO, "asked to end (SIGIO)"),
    (libc::SIGPWR, "the power is failing (SIGPWR)"),
    (libc::SIGSTKFLT, "asked to end (SIGSTKFLT)"),
    (libc::SIGSYS, "asked to end (SIGSYS)"),
    (libc::SIGTRAP, "asked to end (SIGTRAP)"),
    (libc::SIGXCPU, "the limit of processor time is reached (SIGXCPU)"),
    (libc::SIGXFSZ, "asked to end (SIGXFSZ)"),
];

/// Sent to a process of the background that speaks to its terminal: to suspend it for that would suspend the guard. Ignored,
/// the words come through.
const BACKGROUND: [c_int; 2] = [libc::SIGTTIN, libc::SIGTTOU];

thread_local! {
    /// Whether a panic of this thread is its own affair.
    static ENDS_ALONE: Cell<bool> = const { Cell::new(false) };
}

/// A panic of this thread is no reason to end the process: for those that write a recording or a log, with which the guard
/// shares no fate. Who started the thread learns of its end.
pub fn end_alone() {
    ENDS_ALONE.set(true);
}

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
        fault::survive_lost_memory()?;
        let real_time = libc::SIGRTMIN()..=libc::SIGRTMAX();
        for signal in ENDS.into_iter().map(|(signal, _)| signal).chain(real_time) {
            // Whoever starts a bench with `nohup` wants it to outlive the terminal.
            if signal == libc::SIGHUP && is_ignored(signal) {
                continue;
            }
            let reason = Arc::clone(&shutdown.reason);
            let number = usize::try_from(signal).unwrap_or(PANIC);
            on_signal(signal, move |info| {
                if !is_of_a_write(signal, info) {
                    reason.store(number, Ordering::Relaxed);
                }
            })?;
        }
        BACKGROUND.into_iter().for_each(ignore);
        let reason = Arc::clone(&shutdown.reason);
        let report = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            // A thread that is as good as gone has no such word left: then it is one of the others.
            if !ENDS_ALONE.try_with(Cell::get).unwrap_or(false) {
                reason.store(PANIC, Ordering::Relaxed);
            }
            report(panic);
        }));
        Ok(shutdown)
    }

    fn number(&self) -> usize {
        let own = self.reason.load(Ordering::Relaxed);
        match own {
            0 if fault::sent() != 0 => fault::sent(),
            0 if fault::memory_is_lost() => usize::try_from(libc::SIGBUS).unwrap_or(PANIC),
            own => own,
        }
    }

    /// Whether the process is to end.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.number() != 0
    }

    /// Whether somebody or something from outside wants the end: a signal, a panic.
    #[must_use]
    pub fn is_interrupted(&self) -> bool {
        !matches!(self.number(), 0 | DONE)
    }

    /// Asks for the end from inside, unless it was asked for before.
    pub fn request(&self) {
        let reason = match self.number() {
            0 => DONE,
            before => before,
        };
        let _ = self.reason.compare_exchange(0, reason, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Why, in plain words.
    #[must_use]
    pub fn reason(&self) -> &'static str {
        let number = self.number();
        let known = |signal: c_int| ENDS.iter().find(|(known, _)| *known == signal).map(|(_, words)| *words);
        match c_int::try_from(number) {
            Ok(0) => "running",
            Ok(libc::SIGBUS) if fault::memory_is_lost() => {
                "the bench's shared memory was made shorter (SIGBUS)"
            }
            Ok(signal) if fault::FAULTS.contains(&signal) => "asked to end (a signal of the processor's)",
            Ok(signal) => known(signal).unwrap_or("asked to end (a real-time signal)"),
            Err(_) if number == PANIC => "a thread panicked",
            Err(_) => "done",
        }
    }
}

/// Ctrl-C, SIGTERM and a terminal that is closed cancel a computation from now on, which drives nothing; Ctrl-Z and the rest do
/// what they always do.
///
/// # Errors
/// The operating system's.
pub fn cancel_on_signals() -> io::Result<Cancel> {
    let cancel = Cancel::default();
    // With `nohup` it outlives the terminal.
    let is_wanted = |signal: &c_int| *signal != libc::SIGHUP || !is_ignored(*signal);
    for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP].into_iter().filter(is_wanted) {
        let flag = cancel.flag();
        on_signal(signal, move |_| flag.store(true, Ordering::Relaxed))?;
    }
    Ok(cancel)
}

/// A file that may not grow further (`ulimit -f`) is an error of the one write, reported as a full disk is, and no end of the
/// process. For the start of a program, before any thread.
pub fn report_file_limits_as_errors() {
    ignore(libc::SIGXFSZ);
}

/// Has `act` done whenever `signal` comes, beside what is done already. It only stores to an atomic.
#[allow(unsafe_code, reason = "a handler of a signal is named")]
fn on_signal(signal: c_int, act: impl Fn(&siginfo_t) + Send + Sync + 'static) -> io::Result<()> {
    // SAFETY: every `act` of this file loads and stores atomics and asks for the process's own number, all of which may be done
    // in a signal's handler; none of them panics.
    unsafe { signal_hook_registry::register_sigaction(signal, act) }.map(drop)
}

#[allow(unsafe_code, reason = "std does not set signals")]
fn ignore(signal: c_int) {
    // SAFETY: sets the disposition of one signal; no handler is named.
    unsafe { libc::signal(signal, libc::SIG_IGN) };
}

/// Whether a write of this very process was answered with the signal: its reader has gone, or the file may not grow. The
/// error of that write says so to whom it concerns, which is never the guard.
#[allow(unsafe_code, reason = "who sent a signal stands in a union")]
fn is_of_a_write(signal: c_int, info: &siginfo_t) -> bool {
    // SAFETY: the kernel sets the sender for the code that is asked for first.
    let is_own = || info.si_code == libc::SI_USER && unsafe { info.si_pid() == libc::getpid() };
    matches!(signal, libc::SIGPIPE | libc::SIGXFSZ) && is_own()
}

#[allow(unsafe_code, reason = "std does not say what a signal does")]
fn is_ignored(signal: c_int) -> bool {
    // SAFETY: a sigaction is plain data for which zero is valid; the call only writes it.
    let (code, action) = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        (libc::sigaction(signal, std::ptr::null(), &raw mut action), action)
    };
    code == 0 && action.sa_sigaction == libc::SIG_IGN
}
