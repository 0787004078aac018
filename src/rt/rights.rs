//! What the system lets this process do: capabilities and limits.

use std::fs;

/// Bits of `CapEff`, as Linux numbers them in `include/uapi/linux/capability.h`.
const CAP_IPC_LOCK: u64 = 1 << 14;
const CAP_SYS_NICE: u64 = 1 << 23;

/// The capabilities in force for the calling thread.
#[derive(Debug, Clone, Copy)]
pub struct Rights(u64);

impl Rights {
    /// Those of the calling thread; none where the kernel does not say.
    #[must_use]
    pub fn of_this_thread() -> Self {
        Self::parse(&fs::read_to_string("/proc/thread-self/status").unwrap_or_default())
    }

    fn parse(status: &str) -> Self {
        let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
        Self(effective.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0))
    }

    /// Whether it may ask for any priority, whatever the limit.
    #[must_use]
    pub fn has_any_priority(self) -> bool {
        self.0 & CAP_SYS_NICE != 0
    }

    /// [byte] that it may lock; `None` = as many as there are.
    #[must_use]
    pub fn memory_lock_limit(self) -> Option<u64> {
        let limit = soft_limit(libc::RLIMIT_MEMLOCK);
        (self.0 & CAP_IPC_LOCK == 0 && limit != libc::RLIM_INFINITY).then_some(limit)
    }
}

/// The greatest SCHED_FIFO priority that a thread without rights may ask for; 0 = none.
#[must_use]
pub fn priority_limit() -> u64 {
    soft_limit(libc::RLIMIT_RTPRIO)
}

/// The soft limit of a resource.
#[allow(unsafe_code, reason = "std does not say limits")]
fn soft_limit(resource: libc::__rlimit_resource_t) -> u64 {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: `limit` is a valid, writable rlimit for the duration of the call; on failure it stays zero.
    unsafe { libc::getrlimit(resource, &raw mut limit) };
    limit.rlim_cur
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rights_are_read_from_the_effective_set() {
        let of =
            |set: &str| Rights::parse(&format!("CapPrm:\t000001ffffffffff\nCapEff:\t{set}\nCapBnd:\t0\n"));
        let (none, nice, lock) = (of("0000000000000000"), of("0000000000800000"), of("0000000000004000"));
        assert_eq!([none, nice, lock].map(Rights::has_any_priority), [false, true, false]);
        assert_eq!(lock.memory_lock_limit(), None);
        let bytes = soft_limit(libc::RLIMIT_MEMLOCK);
        let expected = (bytes != libc::RLIM_INFINITY).then_some(bytes);
        assert_eq!([none, nice, Rights::parse("")].map(Rights::memory_lock_limit), [expected; 3]);
    }
}
