//! One wait for everything a cycle waits for: descriptors and the clock.

use std::os::fd::RawFd;

use crate::clock::{self, NANOSECONDS_PER_SECOND};

/// Why a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wake {
    /// The deadline came.
    Deadline,
    /// Descriptors are ready: bit n speaks of the n-th one given; also set when it is in error.
    Ready(u32),
    /// A signal arrived.
    Signal,
}

/// Waits until one of `descriptors` can be read or until `deadline_ns` on CLOCK_MONOTONIC. Never spins.
///
/// With nothing but the clock to wait for it sleeps to an absolute time: `ppoll` knows spans only, which grow by what
/// happens between reading the clock and the call, and under the normal scheduler by a thousandth of their length.
#[must_use]
pub fn wait<const N: usize>(descriptors: [RawFd; N], deadline_ns: u64) -> Wake {
    if N == 0 {
        return if clock::sleep_until(deadline_ns).is_ok() { Wake::Deadline } else { Wake::Signal };
    }
    let mut polled = descriptors.map(|fd| libc::pollfd { fd, events: libc::POLLIN, revents: 0 });
    let left = deadline_ns.saturating_sub(clock::monotonic_ns());
    let timeout = libc::timespec {
        tv_sec: i64::try_from(left / NANOSECONDS_PER_SECOND).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(left % NANOSECONDS_PER_SECOND).unwrap_or(0),
    };
    // SAFETY: `polled` has N entries and `timeout` is a valid time; without a signal mask the third pointer may be null.
    let ready =
        unsafe { libc::ppoll(polled.as_mut_ptr(), N as libc::nfds_t, &raw const timeout, std::ptr::null()) };
    match ready {
        0 => Wake::Deadline,
        ready if ready < 0 => Wake::Signal,
        _ => Wake::Ready(
            polled.iter().enumerate().fold(0, |bits, (at, it)| bits | (u32::from(it.revents != 0) << at)),
        ),
    }
}
