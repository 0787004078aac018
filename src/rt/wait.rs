//! One wait for everything a cycle waits for: descriptors and the clock.

use std::mem::size_of;
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
    wait_timed(descriptors, deadline_ns).0
}

/// As [`wait`]; also says when it ended [ns].
///
/// The kernel says how much of the span was left when a descriptor became ready, so that the clock need not be asked on the
/// way of a frame: that is a system call of its own where there is no vDSO. The time it gives is early by what passed between
/// the reading of the clock and the call.
#[must_use]
pub fn wait_timed<const N: usize>(descriptors: [RawFd; N], deadline_ns: u64) -> (Wake, u64) {
    wait_from(descriptors, deadline_ns, clock::monotonic_ns())
}

/// As [`wait_timed`], for one who read the clock a moment ago, at `now_ns`, and can bear that the deadline is late by what
/// passed since, and the time it gives early.
#[must_use]
pub fn wait_from<const N: usize>(descriptors: [RawFd; N], deadline_ns: u64, now_ns: u64) -> (Wake, u64) {
    let mut polled = descriptors.map(|fd| libc::pollfd { fd, events: libc::POLLIN, revents: 0 });
    let left_ns = deadline_ns.saturating_sub(now_ns);
    let mut left = libc::timespec {
        tv_sec: i64::try_from(left_ns / NANOSECONDS_PER_SECOND).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(left_ns % NANOSECONDS_PER_SECOND).unwrap_or(0),
    };
    match poll(&mut polled, &mut left) {
        0 => (Wake::Deadline, clock::monotonic_ns()),
        ready if ready < 0 => (Wake::Signal, clock::monotonic_ns()),
        _ => {
            let bits = polled.iter().enumerate();
            let bits = bits.fold(0, |bits, (at, it)| bits | (u32::from(it.revents != 0) << at));
            let still_ns = left.tv_sec.unsigned_abs().saturating_mul(NANOSECONDS_PER_SECOND);
            let still_ns = still_ns.saturating_add(left.tv_nsec.unsigned_abs());
            // Nothing left may be less than nothing; and a span as it was is one that the kernel does not report.
            let is_known = still_ns > 0 && still_ns < left_ns;
            let at_ns = if is_known { deadline_ns - still_ns } else { clock::monotonic_ns() };
            (Wake::Ready(bits), at_ns)
        }
    }
}

/// The call by its number takes the C library's time as it is.
const _: () = assert!(size_of::<libc::timespec>() == 2 * size_of::<libc::c_long>());

/// `ppoll` as the kernel has it: `left` becomes what is left of the time, which the C library's keeps to itself.
#[allow(unsafe_code, reason = "std has no ppoll")]
fn poll(polled: &mut [libc::pollfd], left: &mut libc::timespec) -> libc::c_long {
    // SAFETY: `polled` is as long as said and `left` is a valid time, both writable; without a signal mask the fourth pointer
    // may be null, and its length is not read.
    unsafe {
        libc::syscall(
            libc::SYS_ppoll,
            polled.as_mut_ptr(),
            polled.len() as libc::nfds_t,
            std::ptr::from_mut(left),
            std::ptr::null::<libc::sigset_t>(),
            0_usize,
        )
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::os::fd::AsRawFd;

    use super::*;

    /// Whether the descriptor is ready when the wait begins or becomes ready in it, or the deadline comes first: the time
    /// given is one at which the wait was on.
    #[test]
    fn the_time_given_is_within_the_wait() {
        let (reader, mut writer) = std::io::pipe().expect("a pipe");
        let timed = |deadline_ns: u64| {
            let before_ns = clock::monotonic_ns();
            let (wake, at_ns) = wait_timed([reader.as_raw_fd()], deadline_ns);
            let after_ns = clock::monotonic_ns();
            assert!((before_ns..=after_ns).contains(&at_ns), "{before_ns} {at_ns} {after_ns}");
            (wake, at_ns)
        };
        let soon_ns = clock::monotonic_ns() + 5_000_000;
        let (wake, at_ns) = timed(soon_ns);
        assert_eq!(wake, Wake::Deadline);
        assert!(at_ns >= soon_ns);
        let far_ns = clock::monotonic_ns() + 60_000_000_000;
        let start_ns = clock::monotonic_ns();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let _ = clock::sleep_until(start_ns + 5_000_000);
                writer.write_all(&[0]).expect("written");
            });
            let (wake, at_ns) = timed(far_ns);
            assert_eq!(wake, Wake::Ready(1));
            assert!(at_ns >= start_ns + 5_000_000, "not before it was written");
        });
        for deadline_ns in [far_ns, 0] {
            assert_eq!(timed(deadline_ns).0, Wake::Ready(1), "ready already");
        }
    }
}
