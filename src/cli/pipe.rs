//! What a command that only computes and prints does when its reader has gone (`rotorbench diagnose ... | head`).

/// Lets a closed pipe end this process, as it ends any other tool of the shell. Not for the processes of a bench: they
/// must live on and send the safe command when the terminal that reads them is closed.
#[allow(unsafe_code, reason = "std does not set signals")]
pub(super) fn end_with_the_reader() {
    // SAFETY: sets the disposition of one signal to the system's default, before any thread is started.
    unsafe { libc::signal(libc::SIGPIPE, libc::SIG_DFL) };
}
