//! Real-time set-up of the calling thread, and what the system really granted.

use std::fmt;
use std::fs;
use std::io;

use serde::{Deserialize, Serialize};

use super::rights::Rights;

/// The `[real_time]` table of the bench file. What is not permitted is reported, and refused only if `required`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RealTimeConfig {
    /// SCHED_FIFO priority, 1 to 99; 0 = the normal scheduler.
    pub priority: u8,
    /// Lock all memory, so that no cycle meets a page fault.
    pub lock_memory: bool,
    /// Processor to stay on; absent = any.
    pub processor: Option<usize>,
    /// [ns] timer slack of the thread (matters under the normal scheduler only); 0 = leave it.
    pub timer_slack_ns: u64,
    /// Refuse to start when something asked for is not granted.
    pub required: bool,
}

impl Default for RealTimeConfig {
    fn default() -> Self {
        Self { priority: 80, lock_memory: true, processor: None, timer_slack_ns: 1, required: false }
    }
}

/// Why the set-up was refused.
#[derive(Debug, thiserror::Error)]
pub enum RealTimeError {
    /// The priority is not one.
    #[error("real_time.priority: {priority} is outside 0..99")]
    Priority {
        /// What was asked for.
        priority: u8,
    },
    /// `required`, and not granted.
    #[error("real_time.required, and not granted: {missing}")]
    Missing {
        /// What and why.
        missing: String,
    },
}

/// What was granted, read back from the system after asking.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Granted {
    /// SCHED_FIFO priority; 0 = the normal scheduler.
    pub priority: u8,
    /// [kB] locked memory of the process.
    pub locked_kb: u64,
    /// Processors the thread may run on.
    pub processors: Vec<usize>,
    /// [ns] timer slack; 0 under SCHED_FIFO, where none is applied.
    pub timer_slack_ns: u64,
    /// What was asked for and not granted, with the system's reason.
    pub refused: Vec<String>,
}

impl fmt::Display for Granted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.priority {
            0 => formatter.write_str("normal scheduler")?,
            priority => write!(formatter, "SCHED_FIFO {priority}")?,
        }
        write!(
            formatter,
            ", {} kB locked, {} processor(s), timer slack {} ns",
            self.locked_kb,
            self.processors.len(),
            self.timer_slack_ns
        )?;
        if !self.refused.is_empty() {
            write!(formatter, "; not granted: {}", self.refused.join(", "))?;
        }
        Ok(())
    }
}

impl RealTimeConfig {
    /// One priority lower, where there is one: for what must not keep the guard's own process from running, whatever becomes of
    /// it. A controller that never waits again starves everything of its own priority on its processor.
    #[must_use]
    pub fn beneath(&self) -> Self {
        Self { priority: if self.priority > 1 { self.priority - 1 } else { self.priority }, ..self.clone() }
    }

    /// Checks what is written.
    ///
    /// # Errors
    /// A priority outside 0..99.
    pub fn check(&self) -> Result<(), RealTimeError> {
        if self.priority > 99 {
            return Err(RealTimeError::Priority { priority: self.priority });
        }
        Ok(())
    }

    /// Sets the calling thread up and reads back what it got. Threads it starts afterwards do not inherit the priority.
    ///
    /// # Errors
    /// [`RealTimeError::Missing`] when `required` and not everything was granted.
    #[allow(unsafe_code, reason = "std locks no memory and sets no timer slack")]
    pub fn apply(&self) -> Result<Granted, RealTimeError> {
        self.check()?;
        let mut refused = Vec::new();
        let mut ask = |what: &str, answer: io::Result<()>| {
            if let Err(error) = answer {
                refused.push(format!("{what} ({error})"));
            }
        };
        if self.lock_memory {
            let limit = Rights::of_this_thread().memory_lock_limit();
            if limit.is_some() {
                touch_stack();
            }
            // Locking what is allocated later, too, would make a later allocation fail at the limit, and a process that
            // cannot allocate ends at once.
            let what = libc::MCL_CURRENT | if limit.is_none() { libc::MCL_FUTURE } else { 0 };
            // SAFETY: no pointer arguments.
            ask("locked memory", answer_of(unsafe { libc::mlockall(what) }));
            if let Some(limit) = limit {
                let why = format!("the limit is {} kB, see `ulimit -l`", limit / 1024);
                ask("locked memory of later allocations", Err(io::Error::other(why)));
            }
        }
        if let Some(processor) = self.processor {
            ask(&format!("processor {processor}"), stay_on(processor));
        }
        if self.timer_slack_ns > 0 {
            // SAFETY: no pointer arguments.
            let code = unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, self.timer_slack_ns) };
            ask("timer slack", answer_of(code));
        }
        if self.priority > 0 {
            ask(&format!("SCHED_FIFO {}", self.priority), schedule(self.priority));
        }
        let granted = Granted {
            priority: granted_priority(),
            locked_kb: locked_kb(),
            processors: granted_processors(),
            timer_slack_ns: granted_timer_slack(),
            refused,
        };
        if self.required && !granted.refused.is_empty() {
            return Err(RealTimeError::Missing { missing: granted.refused.join(", ") });
        }
        Ok(granted)
    }
}

/// Makes the stack as large as it will ever be: a locked stack does not grow beyond the limit, and a process whose
/// stack cannot grow is killed.
#[inline(never)]
fn touch_stack() {
    let mut pages = [0_u8; 512 * 1024];
    std::hint::black_box(&mut pages);
}

/// What a call of the system says by zero or `errno`.
pub(super) fn answer_of(code: i32) -> io::Result<()> {
    if code == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[allow(unsafe_code, reason = "std sets no scheduler")]
fn schedule(priority: u8) -> io::Result<()> {
    let parameters = libc::sched_param { sched_priority: i32::from(priority) };
    // SAFETY: `parameters` is valid for the call; 0 is the calling thread.
    answer_of(unsafe {
        libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &raw const parameters)
    })
}

#[allow(unsafe_code, reason = "std does not say what scheduler a thread has")]
fn granted_priority() -> u8 {
    let mut parameters = libc::sched_param { sched_priority: 0 };
    // SAFETY: no pointer arguments but `parameters`, which is valid; 0 is the calling thread.
    let scheduler = unsafe {
        libc::sched_getparam(0, &raw mut parameters);
        libc::sched_getscheduler(0)
    };
    if scheduler & !libc::SCHED_RESET_ON_FORK == libc::SCHED_FIFO {
        u8::try_from(parameters.sched_priority).unwrap_or(0)
    } else {
        0
    }
}

#[allow(unsafe_code, reason = "std holds no thread on a processor")]
fn stay_on(processor: usize) -> io::Result<()> {
    if processor >= libc::CPU_SETSIZE as usize {
        return Err(io::Error::from_raw_os_error(libc::EINVAL));
    }
    // SAFETY: a cpu_set_t is plain bits, for which zero is valid; the processor is below CPU_SETSIZE.
    let set = unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(processor, &mut set);
        set
    };
    // SAFETY: `set` is valid and as long as said; 0 is the calling thread.
    answer_of(unsafe { libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set) })
}

#[allow(unsafe_code, reason = "std does not say on which processors a thread may run")]
fn granted_processors() -> Vec<usize> {
    // SAFETY: a cpu_set_t is plain bits, for which zero is valid; it is as long as said; 0 is the calling thread.
    unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &raw mut set);
        (0..libc::CPU_SETSIZE as usize).filter(|processor| libc::CPU_ISSET(*processor, &set)).collect()
    }
}

#[allow(unsafe_code, reason = "std does not say what timer slack a thread has")]
fn granted_timer_slack() -> u64 {
    // SAFETY: no pointer arguments.
    u64::try_from(unsafe { libc::prctl(libc::PR_GET_TIMERSLACK) }).unwrap_or(0)
}

fn locked_kb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmLck:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beneath_a_priority_is_the_next_lower_one_if_there_is_one() {
        let beneath = |priority| RealTimeConfig { priority, ..RealTimeConfig::default() }.beneath().priority;
        assert_eq!([99, 80, 2, 1, 0].map(beneath), [98, 79, 1, 1, 0]);
    }

    #[test]
    fn what_is_reported_is_what_the_system_says() {
        // On its own thread: the priority must not stay with the test runner's.
        let granted = std::thread::spawn(|| {
            let config =
                RealTimeConfig { lock_memory: false, processor: Some(0), ..RealTimeConfig::default() };
            (config.apply().expect("not required"), granted_priority())
        });
        let (granted, priority) = granted.join().expect("no panic");
        assert_eq!(granted.priority, priority);
        let refused = granted.refused.iter().any(|line| line.starts_with("SCHED_FIFO"));
        assert_eq!(granted.priority == 80, !refused, "{granted}");
        if !granted.refused.iter().any(|line| line.starts_with("processor")) {
            assert_eq!(granted.processors, [0]);
        }
    }

    #[test]
    fn what_cannot_be_granted_is_refused_if_required() {
        let impossible = RealTimeConfig {
            priority: 0,
            lock_memory: false,
            processor: Some(usize::MAX),
            timer_slack_ns: 0,
            required: true,
        };
        assert!(matches!(impossible.apply(), Err(RealTimeError::Missing { .. })));
        let wrong = RealTimeConfig { priority: 100, ..RealTimeConfig::default() };
        assert!(matches!(wrong.apply(), Err(RealTimeError::Priority { priority: 100 })));
    }
}
