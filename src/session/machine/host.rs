//! The machine: versions, real-time permission, memory, clocks.

use std::fs;
use std::path::Path;

use super::check::{MachineCheck, bad, good, warning};
use crate::bench::BenchConfig;
use crate::clock;
use crate::rt::{Machine, Rights, priority_limit};
use crate::session::thresholds::THRESHOLDS;
use crate::shm::effective_user;

fn read(path: &str) -> Option<String> {
    fs::read_to_string(path).ok().map(|text| text.trim().to_owned()).filter(|text| !text.is_empty())
}

pub(super) fn versions() -> MachineCheck {
    let Machine { kernel, preemption, tick_hz, processors, .. } = Machine::look();
    good("versions", "versions")
        .with("rotorbench", env!("CARGO_PKG_VERSION"))
        .with("kernel", kernel)
        .with("preemption", preemption)
        .with("tick_hz", tick_hz as usize)
        .with("architecture", std::env::consts::ARCH)
        .with("processors", processors)
}

pub(super) fn look(config: &BenchConfig) -> Vec<MachineCheck> {
    let rights = Rights::of_this_thread();
    let mut findings = vec![real_time(rights), throttling(), locked_memory(rights), governor()];
    findings.extend([shared_memory(), clock_source()]);
    findings.extend(remove_ipc(config));
    findings
}

fn real_time(rights: Rights) -> MachineCheck {
    const CHECK: &str = "real-time permission";
    let priority = priority_limit();
    if rights.has_any_priority() {
        return good(CHECK, "any_priority");
    }
    if priority > 0 {
        return good(CHECK, "priority_up_to").with("priority", priority as usize);
    }
    warning(CHECK, "no_priority")
}

fn throttling() -> MachineCheck {
    const CHECK: &str = "real-time throttling";
    match read("/proc/sys/kernel/sched_rt_runtime_us").and_then(|text| text.parse::<i64>().ok()) {
        Some(-1) => good(CHECK, "throttling_off"),
        Some(runtime) => good(CHECK, "throttling_on").with("runtime_us", runtime as f64),
        None => good(CHECK, "kernel_does_not_say"),
    }
}

fn locked_memory(rights: Rights) -> MachineCheck {
    const CHECK: &str = "memory lock limit";
    let Some(bytes) = rights.memory_lock_limit() else {
        return good(CHECK, "lock_unlimited");
    };
    if bytes >= THRESHOLDS.locked_memory_need {
        return good(CHECK, "lock_enough").with("bytes", bytes as usize);
    }
    warning(CHECK, "lock_too_small").with("bytes", bytes as usize)
}

fn governor() -> MachineCheck {
    const CHECK: &str = "frequency governor";
    let files =
        (0..).map(|processor| format!("/sys/devices/system/cpu/cpu{processor}/cpufreq/scaling_governor"));
    let governors: Vec<String> = files.map_while(|file| read(&file)).collect();
    match governors.iter().find(|governor| *governor != "performance") {
        None if governors.is_empty() => good(CHECK, "no_governor"),
        None => good(CHECK, "governor_performance"),
        Some(slow) => warning(CHECK, "governor_slow").with("governor", slow.as_str()),
    }
}

fn shared_memory() -> MachineCheck {
    const CHECK: &str = "/dev/shm";
    if !Path::new(CHECK).is_dir() {
        return bad(CHECK, "shared_memory_missing");
    }
    let Some(free) = free_bytes() else {
        return bad(CHECK, "shared_memory_unreadable");
    };
    if free < THRESHOLDS.shared_memory_need {
        let need = THRESHOLDS.shared_memory_need as usize;
        return bad(CHECK, "shared_memory_full").with("bytes", free as usize).with("needed_bytes", need);
    }
    let is_tmpfs = read("/proc/self/mounts")
        .is_some_and(|text| text.lines().any(|line| line.contains(" /dev/shm tmpfs ")));
    let code = if is_tmpfs { "shared_memory_free" } else { "shared_memory_on_disk" };
    good(CHECK, code).with("bytes", free as usize)
}

/// [byte] free for this user in `/dev/shm`.
#[allow(unsafe_code, reason = "std does not say how much is free")]
fn free_bytes() -> Option<u64> {
    // SAFETY: a statvfs is plain data for which zero is valid.
    let mut found: libc::statvfs = unsafe { std::mem::zeroed() };
    // SAFETY: the path is a constant with its end, and `found` is valid and writable for the duration of the call.
    let code = unsafe { libc::statvfs(c"/dev/shm".as_ptr(), &raw mut found) };
    (code == 0).then(|| found.f_bavail.saturating_mul(found.f_frsize))
}

fn clock_source() -> MachineCheck {
    const CHECK: &str = "clock source";
    let folder = "/sys/devices/system/clocksource/clocksource0";
    let (Some(current), available) = (
        read(&format!("{folder}/current_clocksource")),
        read(&format!("{folder}/available_clocksource")).unwrap_or_default(),
    ) else {
        return good(CHECK, "kernel_does_not_say");
    };
    let cost_ns = reading_ns();
    let faster = available.split_whitespace().find(|it| *it == "tsc" && *it != current);
    let looked = match faster {
        _ if cost_ns < THRESHOLDS.slow_clock_reading_ns => good(CHECK, "clock_fast"),
        Some(fast) => warning(CHECK, "clock_slow")
            .with("faster", fast)
            .with("available", available.as_str())
            .with("file", format!("{folder}/current_clocksource")),
        None => good(CHECK, "clock_slow_without_faster"),
    };
    looked.with("clock", current).with("reading_ns", cost_ns as usize)
}

/// [ns] that a reading of the clock takes, when nothing interrupts it.
fn reading_ns() -> u64 {
    let (batches, readings) = THRESHOLDS.clock_readings;
    let batch = |_| {
        let start_ns = clock::monotonic_ns();
        let end_ns = (1..readings).fold(start_ns, |_, _| clock::monotonic_ns());
        (end_ns - start_ns) / (readings - 1)
    };
    (0..batches).map(batch).min().unwrap_or(0)
}

/// systemd removes a user's shared memory when he logs out, and corrupts a bench that still runs.
fn remove_ipc(config: &BenchConfig) -> Option<MachineCheck> {
    const CHECK: &str = "logind RemoveIPC";
    let is_system_user = effective_user() < 1000;
    if is_system_user || config.shared_memory.group.is_some() || !Path::new("/run/systemd/system").is_dir() {
        return None;
    }
    let mut files = vec!["/etc/systemd/logind.conf".to_owned()];
    let extras = fs::read_dir("/etc/systemd/logind.conf.d").into_iter().flatten().flatten();
    files.extend(extras.map(|entry| entry.path().to_string_lossy().into_owned()));
    let says_no = |text: &str| text.lines().any(|line| line.trim() == "RemoveIPC=no");
    let is_off = files.iter().filter_map(|file| read(file)).any(|text| says_no(&text));
    Some(if is_off { good(CHECK, "remove_ipc_off") } else { warning(CHECK, "remove_ipc_on") })
}
