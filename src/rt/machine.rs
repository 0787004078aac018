//! What of the machine decides its timing, as the kernel reports it.

use std::fs;

use serde::Serialize;

use crate::clock;

/// The machine under a cycle.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Release of the kernel.
    pub kernel: String,
    /// How far the kernel lets itself be interrupted: `PREEMPT_RT`, `PREEMPT_DYNAMIC (full)`, `PREEMPT`, `none`.
    pub preemption: String,
    /// [Hz] ticks of the scheduler, CONFIG_HZ.
    pub tick_hz: u64,
    /// [ns] what a timer can be set to; the tick where there are no high-resolution timers.
    pub timer_resolution_ns: u64,
    /// What the clock is read from.
    pub clock_source: String,
    /// Processors that run.
    pub processors: usize,
    /// Processors kept free of other work (`isolcpus=`), as the kernel lists them; empty = none.
    pub isolated: String,
    /// Processors without a tick while one thread has them (`nohz_full=`); empty = none.
    pub tickless: String,
    /// Frequency governors in use, each once; empty = the kernel scales no frequency.
    pub governors: Vec<String>,
    /// Whether it is a virtual machine, whose host may take the processor away unseen.
    pub is_virtual: bool,
}

impl Machine {
    /// This machine, now. What the kernel does not report is empty or zero.
    #[must_use]
    pub fn look() -> Self {
        let build = read("/proc/sys/kernel/version");
        let processors = read("/proc/cpuinfo");
        let resolution_ns = clock::coarse_resolution_ns();
        Self {
            kernel: read("/proc/sys/kernel/osrelease"),
            preemption: preemption(
                &build,
                &read("/sys/kernel/realtime"),
                &read("/sys/kernel/debug/sched/preempt"),
            ),
            tick_hz: clock::NANOSECONDS_PER_SECOND.checked_div(resolution_ns).unwrap_or(0),
            timer_resolution_ns: clock::resolution_ns(),
            clock_source: read("/sys/devices/system/clocksource/clocksource0/current_clocksource"),
            processors: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            isolated: read("/sys/devices/system/cpu/isolated"),
            tickless: no_list(read("/sys/devices/system/cpu/nohz_full")),
            governors: governors(),
            is_virtual: processors.lines().any(|line| {
                line.starts_with("flags") && line.split_whitespace().any(|it| it == "hypervisor")
            }),
        }
    }
}

fn read(path: &str) -> String {
    fs::read_to_string(path).map(|text| text.trim().to_owned()).unwrap_or_default()
}

/// Some kernels write `(null)` for an empty list.
fn no_list(text: String) -> String {
    if text.starts_with('(') { String::new() } else { text }
}

fn governors() -> Vec<String> {
    let file = |processor: usize| format!("/sys/devices/system/cpu/cpu{processor}/cpufreq/scaling_governor");
    let mut found: Vec<String> = (0..).map(|it| read(&file(it))).take_while(|it| !it.is_empty()).collect();
    found.sort();
    found.dedup();
    found
}

/// From the kernel's build line, its word that it is real-time, and the scheduler's choice (`none voluntary (full)`),
/// which only root may read.
fn preemption(build: &str, real_time: &str, choice: &str) -> String {
    if real_time == "1" {
        return "PREEMPT_RT".to_owned();
    }
    let word = ["PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"].into_iter().find(|it| build.contains(it));
    let chosen = choice.split_whitespace().find_map(|it| it.strip_prefix('(')?.strip_suffix(')'));
    match (word, chosen) {
        (Some(word), Some(chosen)) => format!("{word} ({chosen})"),
        (Some(word), None) => word.to_owned(),
        (None, _) => "none".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preemption_model_is_read_from_what_kernels_say() {
        for (build, real_time, choice, model) in [
            ("#1 SMP PREEMPT_DYNAMIC @0", "", "none voluntary (full)", "PREEMPT_DYNAMIC (full)"),
            ("#1 SMP PREEMPT_DYNAMIC Debian 6.1", "", "", "PREEMPT_DYNAMIC"),
            ("#1 SMP PREEMPT_RT Debian 6.1", "1", "", "PREEMPT_RT"),
            ("#1 SMP Debian 4.19", "", "", "none"),
        ] {
            assert_eq!(preemption(build, real_time, choice), model);
        }
    }

    #[test]
    fn this_machine_has_a_kernel_a_tick_and_a_clock() {
        let machine = Machine::look();
        assert_eq!(machine.kernel, read("/proc/sys/kernel/osrelease"));
        // The kernels that are built have 100, 250, 300 or 1000; a tick of 3,333,333 ns is 300 Hz.
        assert!((50..=2000).contains(&machine.tick_hz), "{machine:?}");
        assert!(machine.timer_resolution_ns > 0 && machine.processors > 0);
        assert!(machine.governors.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
