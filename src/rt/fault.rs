//! Signals that the processor raises about a process's own instructions, above all SIGBUS: somebody made a file of the
//! bench's shared memory shorter, and the next look at it has nothing to look at.
//!
//! That must not end the guard's process in the middle of a run. The handler puts a page of its own in the place of the one
//! that is gone, so that the instruction can go on, and says that the memory is lost; from then on nobody looks at shared
//! memory ([`memory_is_lost`]), and [`super::Shutdown`] asks for the end, which is the ramp to zero. The same signals sent by
//! another process are a wish to end like any other. A defect of the program itself, which nothing can go on from, ends it as
//! it would without a handler.

use std::io;
use std::mem;
use std::ptr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use libc::{c_int, c_void, sigaction, siginfo_t};

use super::thread::answer_of;

/// What is listened to here; all other signals in `shutdown.rs`.
pub(super) const FAULTS: [c_int; 4] = [libc::SIGBUS, libc::SIGSEGV, libc::SIGILL, libc::SIGFPE];

/// The memory of the bench is gone.
static IS_LOST: AtomicBool = AtomicBool::new(false);
/// Number of the signal of ours that another process sent; 0 = none.
static SENT: AtomicUsize = AtomicUsize::new(0);
/// [byte] of a page.
static PAGE: AtomicUsize = AtomicUsize::new(0);
/// What was done at these signals before us.
static BEFORE: OnceLock<[sigaction; FAULTS.len()]> = OnceLock::new();

/// Whether shared memory was taken away from this process: what is read there since is nobody's.
#[must_use]
pub fn memory_is_lost() -> bool {
    IS_LOST.load(Ordering::Relaxed)
}

/// The signal of ours that another process sent, 0 = none.
pub(super) fn sent() -> usize {
    SENT.load(Ordering::Relaxed)
}

/// Survives the loss of shared memory from now on. Once for a process; more do nothing.
///
/// # Errors
/// The operating system's.
#[allow(unsafe_code, reason = "std has no handlers of faults")]
pub fn survive_lost_memory() -> io::Result<()> {
    // SAFETY: sigactions are plain data for which zero is valid, the calls read and write nothing else, and the handler does
    // only what may be done in one.
    unsafe {
        let mut before: [sigaction; FAULTS.len()] = mem::zeroed();
        for (signal, action) in FAULTS.into_iter().zip(&mut before) {
            answer_of(libc::sigaction(signal, ptr::null(), action))?;
        }
        if BEFORE.set(before).is_err() {
            return Ok(());
        }
        PAGE.store(usize::try_from(libc::sysconf(libc::_SC_PAGESIZE)).unwrap_or(4096), Ordering::Relaxed);
        let mut ours: sigaction = mem::zeroed();
        ours.sa_sigaction = on_fault as *const () as usize;
        // On a stack of its own: a stack that overflowed is one of the defects.
        ours.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK | libc::SA_RESTART;
        for signal in FAULTS {
            answer_of(libc::sigaction(signal, &raw const ours, ptr::null_mut()))?;
        }
    }
    Ok(())
}

/// The handler. No allocation, no lock: it may run between any two instructions.
#[allow(unsafe_code, reason = "the handler of a fault, which the kernel calls")]
extern "C" fn on_fault(signal: c_int, info: *mut siginfo_t, _: *mut c_void) {
    // SAFETY: the kernel hands a siginfo over, whose address is set for faults; errno is this thread's own; the sigaction was
    // the system's own answer.
    unsafe {
        let code = (*info).si_code;
        if code <= 0 {
            SENT.store(usize::try_from(signal).unwrap_or(usize::MAX), Ordering::Relaxed);
            return;
        }
        let is_lost_memory = signal == libc::SIGBUS && code == libc::BUS_ADRERR;
        let errno = libc::__errno_location();
        let kept = *errno;
        if is_lost_memory && put_a_page_at((*info).si_addr()) {
            IS_LOST.store(true, Ordering::Relaxed);
        } else if let Some((_, before)) =
            FAULTS.into_iter().zip(BEFORE.get().into_iter().flatten()).find(|(fault, _)| *fault == signal)
        {
            // The instruction is tried again, and fails again, for whom it concerned before us.
            libc::sigaction(signal, before, ptr::null_mut());
        }
        *errno = kept;
    }
}

/// A page of this process's own in the place of the one at `address`; whether the system gave one.
#[allow(unsafe_code, reason = "a page is put where one is missing")]
fn put_a_page_at(address: *mut c_void) -> bool {
    let size = PAGE.load(Ordering::Relaxed);
    let start = (address as usize / size * size) as *mut c_void;
    let access = libc::PROT_READ | libc::PROT_WRITE;
    let kind = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_FIXED;
    // SAFETY: the page replaces one of a file that has no such page any more: nothing that was there is lost. It is `size`
    // bytes, all of which are written.
    unsafe {
        if libc::mmap(start, size, access, kind, -1, 0) == libc::MAP_FAILED {
            return false;
        }
        // iceoryx2 counts its writes from one, and a build with overflow checks takes one off: a page of zeros would panic.
        let words = start.cast::<u64>();
        (0..size / mem::size_of::<u64>()).for_each(|at| words.add(at).write(1));
    }
    true
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsRawFd as _;

    use super::*;

    /// In a process of its own: the flag is for ever.
    #[test]
    #[allow(unsafe_code, reason = "the test makes the fault in a child process")]
    fn a_look_at_memory_that_is_gone_goes_on() {
        let file = tempfile::tempfile().expect("a file");
        file.set_len(8192).expect("long enough");
        survive_lost_memory().expect("handlers can be set");
        // SAFETY: fork of a process whose child calls only what may be called then, and leaves by `_exit`; the mapping is as
        // long as said.
        let status = unsafe {
            let memory = libc::mmap(
                ptr::null_mut(),
                8192,
                libc::PROT_READ | libc::PROT_WRITE,
                libc::MAP_SHARED,
                file.as_raw_fd(),
                0,
            );
            assert_ne!(memory, libc::MAP_FAILED);
            let child = libc::fork();
            if child == 0 {
                libc::ftruncate(file.as_raw_fd(), 0);
                let word = memory.cast::<u64>().add(600);
                let read = word.read_volatile();
                word.write_volatile(7);
                let goes_on = read == 1 && word.read_volatile() == 7 && memory_is_lost();
                libc::_exit(if goes_on { 0 } else { 1 });
            }
            let mut status = 0;
            assert_eq!(libc::waitpid(child, &raw mut status, 0), child);
            libc::munmap(memory, 8192);
            status
        };
        assert_eq!(status, 0, "exit 0, and no signal");
        assert!(!memory_is_lost(), "only in the child");
    }
}
