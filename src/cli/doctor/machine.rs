//! The machine: versions, real-time permission, memory, clocks.

use std::fs;
use std::path::Path;

use super::Finding;
use crate::bench::BenchConfig;
use crate::cli::thresholds::THRESHOLDS;
use crate::clock;
use crate::rt::Machine;

/// Bits of `CapEff` in `/proc/self/status`.
const CAP_IPC_LOCK: u64 = 1 << 14;
const CAP_SYS_NICE: u64 = 1 << 23;
/// Gives the program both rights at once.
const CAPABILITIES: &str = "sudo setcap cap_sys_nice,cap_ipc_lock+ep \"$(command -v rotorbench)\"";

fn read(path: &str) -> Option<String> {
    fs::read_to_string(path).ok().map(|text| text.trim().to_owned()).filter(|text| !text.is_empty())
}

pub(super) fn versions() -> Vec<Finding> {
    let Machine { kernel, preemption, tick_hz, processors, .. } = Machine::look();
    let preemption = if preemption == "none" { "not preemptible".to_owned() } else { preemption };
    vec![Finding::good(
        "versions",
        format!(
            "rotorbench {}, Linux {kernel} ({preemption}, {tick_hz} Hz), {}, {processors} processors",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::ARCH
        ),
    )]
}

pub(super) fn findings(config: &BenchConfig) -> Vec<Finding> {
    let rights = read("/proc/self/status")
        .and_then(|text| {
            let line = text.lines().find_map(|line| line.strip_prefix("CapEff:"))?.trim().to_owned();
            u64::from_str_radix(&line, 16).ok()
        })
        .unwrap_or(0);
    let mut findings = vec![real_time(rights), throttling(), locked_memory(rights), governor()];
    findings.extend([shared_memory(), clock_source()]);
    findings.extend(remove_ipc(config));
    findings
}

/// The soft limit of a resource.
fn limit(resource: libc::__rlimit_resource_t) -> u64 {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: `limit` is a valid, writable rlimit for the duration of the call; on failure it stays zero.
    unsafe { libc::getrlimit(resource, &raw mut limit) };
    limit.rlim_cur
}

fn real_time(rights: u64) -> Finding {
    const CHECK: &str = "real-time permission";
    let priority = limit(libc::RLIMIT_RTPRIO);
    if rights & CAP_SYS_NICE != 0 {
        return Finding::good(CHECK, "SCHED_FIFO of any priority");
    }
    if priority > 0 {
        return Finding::good(CHECK, format!("SCHED_FIFO up to priority {priority}"));
    }
    let found = "none: the loop runs at ordinary priority, with lateness of milliseconds under load";
    Finding::warning(CHECK, found, CAPABILITIES)
}

fn throttling() -> Finding {
    const CHECK: &str = "real-time throttling";
    match read("/proc/sys/kernel/sched_rt_runtime_us").and_then(|text| text.parse::<i64>().ok()) {
        Some(-1) => Finding::good(CHECK, "off: a loop that spins would hang its processor"),
        Some(runtime) => {
            Finding::good(CHECK, format!("{runtime} µs of each second, which a sleeping loop never meets"))
        }
        None => Finding::good(CHECK, "the kernel does not say"),
    }
}

fn locked_memory(rights: u64) -> Finding {
    const CHECK: &str = "memory lock limit";
    let bytes = limit(libc::RLIMIT_MEMLOCK);
    if rights & CAP_IPC_LOCK != 0 || bytes == libc::RLIM_INFINITY {
        return Finding::good(CHECK, "none");
    }
    let found =
        format!("{} kB: the loop's memory may be paged out, each time costing milliseconds", bytes / 1024);
    if bytes >= THRESHOLDS.locked_memory_need {
        return Finding::good(CHECK, format!("{} MB, enough", bytes >> 20));
    }
    Finding::warning(CHECK, found, CAPABILITIES)
}

fn governor() -> Finding {
    const CHECK: &str = "frequency governor";
    let files =
        (0..).map(|processor| format!("/sys/devices/system/cpu/cpu{processor}/cpufreq/scaling_governor"));
    let governors: Vec<String> = files.map_while(|file| read(&file)).collect();
    match governors.iter().find(|governor| *governor != "performance") {
        None if governors.is_empty() => Finding::good(CHECK, "the kernel scales no frequency here"),
        None => Finding::good(CHECK, "performance"),
        Some(slow) => Finding::warning(
            CHECK,
            format!("{slow}: a sleeping loop wakes on a slow processor, tens of µs later"),
            "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor",
        ),
    }
}

fn shared_memory() -> Finding {
    const CHECK: &str = "/dev/shm";
    let mend = "sudo mount -o remount,size=256M /dev/shm";
    let mounted = read("/proc/self/mounts")
        .is_some_and(|text| text.lines().any(|line| line.contains(" /dev/shm tmpfs ")));
    if !Path::new(CHECK).is_dir() {
        return Finding::bad(
            CHECK,
            "not there: no shared memory, so no bench",
            "sudo mount -t tmpfs -o size=256M tmpfs /dev/shm",
        );
    }
    let Some(free) = free_bytes() else {
        return Finding::bad(CHECK, "its free space cannot be read", mend);
    };
    if free < THRESHOLDS.shared_memory_need {
        return Finding::bad(
            CHECK,
            format!("{} MB free; a bench needs up to {}", free >> 20, THRESHOLDS.shared_memory_need >> 20),
            mend,
        );
    }
    let kind = if mounted { "tmpfs" } else { "not a tmpfs: shared memory may touch a disk" };
    Finding::good(CHECK, format!("{kind}, {} MB free", free >> 20))
}

/// [byte] free for this user in `/dev/shm`.
fn free_bytes() -> Option<u64> {
    // SAFETY: a statvfs is plain data for which zero is valid.
    let mut found: libc::statvfs = unsafe { std::mem::zeroed() };
    // SAFETY: the path is a constant with its end, and `found` is valid and writable for the duration of the call.
    let code = unsafe { libc::statvfs(c"/dev/shm".as_ptr(), &raw mut found) };
    (code == 0).then(|| found.f_bavail.saturating_mul(found.f_frsize))
}

fn clock_source() -> Finding {
    const CHECK: &str = "clock source";
    let folder = "/sys/devices/system/clocksource/clocksource0";
    let (Some(current), available) = (
        read(&format!("{folder}/current_clocksource")),
        read(&format!("{folder}/available_clocksource")).unwrap_or_default(),
    ) else {
        return Finding::good(CHECK, "the kernel does not say");
    };
    let cost = reading_ns();
    let found = if cost < 1000 {
        format!("{current}: a reading costs {cost} ns")
    } else {
        format!("{current}: a reading costs {:.1} µs", cost as f64 * 1e-3)
    };
    if cost < THRESHOLDS.slow_clock_reading_ns {
        return Finding::good(CHECK, found);
    }
    match available.split_whitespace().find(|it| *it == "tsc" && *it != current) {
        Some(fast) => {
            let mend = format!("echo {fast} | sudo tee {folder}/current_clocksource");
            Finding::warning(CHECK, format!("{found} (there are: {available})"), mend)
        }
        None => Finding::good(CHECK, format!("{found}, and this machine has no faster clock")),
    }
}

/// [ns] that a reading of the clock takes, when nothing interrupts it.
fn reading_ns() -> u64 {
    const READINGS: u64 = 100;
    let batch = |_| {
        let start_ns = clock::monotonic_ns();
        let end_ns = (1..READINGS).fold(start_ns, |_, _| clock::monotonic_ns());
        (end_ns - start_ns) / (READINGS - 1)
    };
    (0..50).map(batch).min().unwrap_or(0)
}

/// systemd removes a user's shared memory when he logs out, and corrupts a bench that still runs.
fn remove_ipc(config: &BenchConfig) -> Option<Finding> {
    const CHECK: &str = "logind RemoveIPC";
    // SAFETY: geteuid has no arguments and cannot fail.
    let is_system_user = unsafe { libc::geteuid() } < 1000;
    if is_system_user || config.shared_memory.group.is_some() || !Path::new("/run/systemd/system").is_dir() {
        return None;
    }
    let mut files = vec!["/etc/systemd/logind.conf".to_owned()];
    let extras = fs::read_dir("/etc/systemd/logind.conf.d").into_iter().flatten().flatten();
    files.extend(extras.map(|entry| entry.path().to_string_lossy().into_owned()));
    let says_no = |text: &str| text.lines().any(|line| line.trim() == "RemoveIPC=no");
    if files.iter().filter_map(|file| read(file)).any(|text| says_no(&text)) {
        return Some(Finding::good(CHECK, "no: benches outlive a logout"));
    }
    Some(Finding::warning(
        CHECK,
        "yes: a bench left running is corrupted when you log out",
        "sudo sh -c 'mkdir -p /etc/systemd/logind.conf.d; printf \"[Login]\\nRemoveIPC=no\\n\" > \
         /etc/systemd/logind.conf.d/rotorbench.conf; systemctl restart systemd-logind'",
    ))
}
