//! What the kernel counted of a thread: the disturbances that a histogram shows, and their kind.

use serde::Serialize;

/// Counters of a thread since it began, or between two looks at it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Usage {
    /// Page faults served from memory.
    pub minor_page_faults: u64,
    /// Page faults that had to wait for a disk.
    pub major_page_faults: u64,
    /// Switches to another thread because this one waited.
    pub voluntary_context_switches: u64,
    /// Switches to another thread although this one had work to do.
    pub involuntary_context_switches: u64,
}

impl Usage {
    /// Of the calling thread, since it began.
    #[must_use]
    #[allow(unsafe_code, reason = "std has no getrusage")]
    pub fn of_this_thread() -> Self {
        // SAFETY: a rusage is plain data for which zero is valid; the call only writes it. It cannot fail for RUSAGE_THREAD.
        let usage = unsafe {
            let mut usage: libc::rusage = std::mem::zeroed();
            libc::getrusage(libc::RUSAGE_THREAD, &raw mut usage);
            usage
        };
        Self {
            minor_page_faults: usage.ru_minflt.unsigned_abs(),
            major_page_faults: usage.ru_majflt.unsigned_abs(),
            voluntary_context_switches: usage.ru_nvcsw.unsigned_abs(),
            involuntary_context_switches: usage.ru_nivcsw.unsigned_abs(),
        }
    }

    /// What came since `before`.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        Self {
            minor_page_faults: self.minor_page_faults.saturating_sub(before.minor_page_faults),
            major_page_faults: self.major_page_faults.saturating_sub(before.major_page_faults),
            voluntary_context_switches: self
                .voluntary_context_switches
                .saturating_sub(before.voluntary_context_switches),
            involuntary_context_switches: self
                .involuntary_context_switches
                .saturating_sub(before.involuntary_context_switches),
        }
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            minor_page_faults: self.minor_page_faults + other.minor_page_faults,
            major_page_faults: self.major_page_faults + other.major_page_faults,
            voluntary_context_switches: self.voluntary_context_switches + other.voluntary_context_switches,
            involuntary_context_switches: self.involuntary_context_switches
                + other.involuntary_context_switches,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_and_a_touched_page_are_counted() {
        let before = Usage::of_this_thread();
        let pages = vec![1_u8; 64 << 20];
        std::thread::sleep(std::time::Duration::from_millis(2));
        let counted = Usage::of_this_thread().since(before);
        assert!(pages.iter().all(|byte| *byte == 1));
        assert!(counted.voluntary_context_switches >= 1, "{counted:?}");
        // Huge pages of 2 MB are the largest that an allocation of this kind gets: at least 32 of them.
        assert!(counted.minor_page_faults >= 32, "{counted:?}");
        let twice = counted.and(counted);
        assert_eq!(twice.since(counted), counted);
    }
}
