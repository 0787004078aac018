//! Monotonic nanosecond stamps and the absolute-time sleep every cycle stands on.

use std::io;

/// Nanoseconds in one second.
pub const NANOSECONDS_PER_SECOND: u64 = 1_000_000_000;

/// [ns] CLOCK_MONOTONIC now: the one clock of the house. The same in every process of one machine.
#[must_use]
pub fn monotonic_ns() -> u64 {
    read_ns(libc::CLOCK_MONOTONIC)
}

/// [ns] CLOCK_REALTIME now: for file names and for socket stamps only, never for control.
#[must_use]
pub fn realtime_ns() -> u64 {
    read_ns(libc::CLOCK_REALTIME)
}

/// [ns] resolution of CLOCK_MONOTONIC, which is that of a timer on it.
#[must_use]
pub fn resolution_ns() -> u64 {
    resolution_of_ns(libc::CLOCK_MONOTONIC)
}

/// [ns] resolution of the clock that the kernel steps with each tick: the tick's period, 1 / CONFIG_HZ.
#[must_use]
pub fn coarse_resolution_ns() -> u64 {
    resolution_of_ns(libc::CLOCK_MONOTONIC_COARSE)
}

/// [ns] of a span in seconds; negative, not-a-number and oversized spans saturate.
#[must_use]
pub fn span_ns(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

/// [s] of a span in nanoseconds.
#[must_use]
pub fn span_s(nanoseconds: u64) -> f64 {
    nanoseconds as f64 * 1e-9
}

#[allow(unsafe_code, reason = "Instant does not say its number")]
fn read_ns(clock: libc::clockid_t) -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `now` is a valid, writable timespec for the duration of the call. The call cannot fail for
    // the two constant clock ids used here; on failure `now` stays zero, which callers treat as "never".
    unsafe { libc::clock_gettime(clock, &raw mut now) };
    now.tv_sec.unsigned_abs() * NANOSECONDS_PER_SECOND + now.tv_nsec.unsigned_abs()
}

#[allow(unsafe_code, reason = "std does not say how fine a clock is")]
fn resolution_of_ns(clock: libc::clockid_t) -> u64 {
    let mut resolution = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `resolution` is a valid, writable timespec for the duration of the call; on failure it stays zero.
    unsafe { libc::clock_getres(clock, &raw mut resolution) };
    resolution.tv_sec.unsigned_abs() * NANOSECONDS_PER_SECOND + resolution.tv_nsec.unsigned_abs()
}

/// Sleeps until `deadline_ns` on CLOCK_MONOTONIC. Returns early, with `Interrupted`, when a signal arrives.
///
/// # Errors
/// The operating system's error of `clock_nanosleep`.
#[allow(unsafe_code, reason = "std sleeps for a time, not until one")]
pub fn sleep_until(deadline_ns: u64) -> io::Result<()> {
    let deadline = libc::timespec {
        tv_sec: i64::try_from(deadline_ns / NANOSECONDS_PER_SECOND).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(deadline_ns % NANOSECONDS_PER_SECOND).unwrap_or(0),
    };
    // SAFETY: `deadline` is a valid timespec; the remainder pointer may be null for TIMER_ABSTIME.
    let code = unsafe {
        libc::clock_nanosleep(
            libc::CLOCK_MONOTONIC,
            libc::TIMER_ABSTIME,
            &raw const deadline,
            std::ptr::null_mut(),
        )
    };
    if code == 0 { Ok(()) } else { Err(io::Error::from_raw_os_error(code)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_goes_back_and_sleeps_past_the_deadline() {
        let start = monotonic_ns();
        assert!(start > 0);
        let deadline = start + 2_000_000;
        sleep_until(deadline).expect("no signal in this test");
        assert!(monotonic_ns() >= deadline);
    }

    #[test]
    fn spans_saturate_instead_of_wrapping() {
        assert_eq!(span_ns(0.02), 20_000_000);
        assert_eq!(span_ns(-1.0), 0);
        assert_eq!(span_ns(f64::NAN), 0);
        assert_eq!(span_ns(f64::INFINITY), u64::MAX);
        assert!((span_s(20_000_000) - 0.02).abs() < 1e-18);
    }
}
