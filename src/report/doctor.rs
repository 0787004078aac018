//! What `doctor` says of a machine, and the commands that mend it.

use std::fmt::Write as _;

use serde::Serialize;

use crate::screening::Finding;
use crate::session::{Grade, MachineCheck};

/// Gives the program both rights at once.
const CAPABILITIES: &str = "sudo setcap cap_sys_nice,cap_ipc_lock+ep \"$(command -v rotorbench)\"";

/// One thing looked at, for a script.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct DoctorRow<'a> {
    /// What was looked at.
    check: &'a str,
    /// How bad it is.
    grade: Grade,
    /// What was found, and what it means.
    found: String,
    /// The one command that mends it.
    #[serde(skip_serializing_if = "Option::is_none")]
    mend: Option<String>,
    /// The same as a code with its evidence.
    finding: &'a Finding,
}

/// What was looked at, one row a check.
#[must_use]
pub fn rows<'a>(looked: &'a [MachineCheck]) -> Vec<DoctorRow<'a>> {
    let row = |it: &'a MachineCheck| DoctorRow {
        check: &it.finding.subject,
        grade: it.grade,
        found: found(&it.finding),
        mend: it.is_wanting().then(|| mend(&it.finding)),
        finding: &it.finding,
    };
    looked.iter().map(row).collect()
}

/// The rows as lines.
#[must_use]
pub fn text(rows: &[DoctorRow]) -> String {
    let mut text = String::new();
    let groups: Vec<&[DoctorRow]> = rows.chunk_by(|one, next| are_alike(one.finding, next.finding)).collect();
    for (index, group) in groups.iter().enumerate() {
        let Some(row) = group.first() else { continue };
        let mark = match row.grade {
            Grade::Good => "ok  ",
            Grade::Warning => "warn",
            Grade::Bad => "BAD ",
            Grade::Mended => "done",
        };
        let found = if group.len() == 1 { row.found.clone() } else { dead_benches(group) };
        // Writing to a `String` cannot fail.
        let _ = writeln!(text, "{mark} {:<22}{found}", row.check);
        // What mends several in a row is said once, behind the last of them.
        let next = groups.get(index + 1).and_then(|next| next.first());
        let is_last = next.is_none_or(|next| next.mend != row.mend);
        if let Some(mend) = row.mend.as_ref().filter(|_| is_last) {
            let _ = writeln!(text, "     {:<22}→ {mend}", "");
        }
    }
    text
}

/// Whether two dead benches came to the same: they share a line.
fn are_alike(one: &Finding, other: &Finding) -> bool {
    let is_dead = one.code.starts_with("dead_bench") && one.code == other.code;
    is_dead && one.text("error") == other.text("error")
}

/// Names of dead benches that are shown.
const NAMED: usize = 3;

/// What several dead benches left, in one line.
fn dead_benches(group: &[DoctorRow]) -> String {
    let sum = |name| group.iter().map(|row| row.finding.count(name)).sum::<usize>();
    let names: Vec<String> =
        group.iter().take(NAMED).map(|row| format!("`{}`", row.finding.text("bench"))).collect();
    let more = if group.len() > NAMED { ", ..." } else { "" };
    let removed = match group.first().map(|row| row.finding) {
        Some(finding) if finding.code == "dead_bench_removed" => ": removed".to_owned(),
        Some(finding) if finding.code == "dead_bench_stays" => format!(": {}", finding.text("error")),
        _ => String::new(),
    };
    format!(
        "{} benches ({}{more}) have no process and left {} files, {} kB{removed}",
        group.len(),
        names.join(", "),
        sum("files"),
        sum("bytes") / 1024
    )
}

/// What was found where there is nothing to fill in.
fn fixed(code: &str) -> Option<&'static str> {
    let sentence = match code {
        "kernel_does_not_say" => "the kernel does not say",
        "can_there" => "it is there",
        "can_not_loaded" => "not loaded, but there as modules",
        "restart_off" => "0: after bus off the controller stays off until somebody restarts it",
        "stamps_of_adapter" => "the adapter stamps frames itself",
        "stamps_of_kernel" => "the kernel stamps frames on arrival; the adapter does not",
        "stamps_unknown" => "the interface does not say; the kernel stamps frames on arrival",
        "any_priority" => "SCHED_FIFO of any priority",
        "no_priority" => "none: the loop runs at ordinary priority, with lateness of milliseconds under load",
        "throttling_off" => "off: a loop that spins would hang its processor",
        "lock_unlimited" => "none",
        "no_governor" => "the kernel scales no frequency here",
        "governor_performance" => "performance",
        "shared_memory_missing" => "not there: no shared memory, so no bench",
        "shared_memory_unreadable" => "its free space cannot be read",
        "remove_ipc_off" => "no: benches outlive a logout",
        "remove_ipc_on" => "yes: a bench left running is corrupted when you log out",
        "no_dead_bench" => "none has left anything in shared memory",
        _ => return None,
    };
    Some(sentence)
}

/// What was found, and what it means.
fn found(finding: &Finding) -> String {
    let (count, text) = (|name| finding.count(name), |name| finding.text(name));
    let kilobytes = || count("bytes") / 1024;
    let megabytes = |name| count(name) >> 20;
    let left = || {
        format!(
            "bench `{}` has no process and left {} files, {} kB",
            text("bench"),
            count("files"),
            kilobytes()
        )
    };
    if let Some(sentence) = fixed(finding.code) {
        return sentence.to_owned();
    }
    match finding.code {
        "versions" => versions(finding),
        "can_not_built" => {
            format!("kernel {} was built without it: no bus, real or virtual, can be opened", text("kernel"))
        }
        "interface_unreadable" => text("error").to_owned(),
        "multicast_stays" => {
            format!(
                "{} on {}: no CAN is needed, nothing leaves this machine",
                text("interface"),
                text("device")
            )
        }
        "multicast_leaves" => format!(
            "{} goes out on {}: whoever is in that network can command the rotors",
            text("interface"),
            text("device")
        ),
        "interface_up" => format!("{} is up", text("interface")),
        "interface_down" => format!("{} is down", text("interface")),
        "bit_rate_of_virtual" => format!("{} is virtual: it has none", text("interface")),
        "bit_rate_as_configured" => format!("{} bit/s, as the bench file says", count("bit_rate")),
        "bit_rate_differs" => format!(
            "{} runs at {} bit/s; the bench file says {}: one of them is wrong",
            text("interface"),
            count("bit_rate"),
            count("configured_bit_rate")
        ),
        "restart_on" => format!("{} ms after bus off the controller comes back", count("restart_ms")),
        "queue_short" => format!("{}: no more stale commands than that after a stall", count("frames")),
        "queue_long" => {
            format!("{0}: after a stall up to {0} stale commands would still leave", count("frames"))
        }
        "priority_up_to" => format!("SCHED_FIFO up to priority {}", count("priority")),
        "throttling_on" => {
            format!("{} µs of each second, which a sleeping loop never meets", finding.number("runtime_us"))
        }
        "lock_enough" => format!("{} MB, enough", megabytes("bytes")),
        "lock_too_small" => {
            format!("{} kB: the loop's memory may be paged out, each time costing milliseconds", kilobytes())
        }
        "governor_slow" => {
            format!("{}: a sleeping loop wakes on a slow processor, tens of µs later", text("governor"))
        }
        "shared_memory_full" => {
            format!("{} MB free; a bench needs up to {}", megabytes("bytes"), megabytes("needed_bytes"))
        }
        "shared_memory_free" => format!("tmpfs, {} MB free", megabytes("bytes")),
        "shared_memory_on_disk" => {
            format!("not a tmpfs: shared memory may touch a disk, {} MB free", megabytes("bytes"))
        }
        "clock_fast" => clock(finding),
        "clock_slow" => format!("{} (there are: {})", clock(finding), text("available")),
        "clock_slow_without_faster" => format!("{}, and this machine has no faster clock", clock(finding)),
        "dead_bench" => left(),
        "dead_bench_removed" => left() + ": removed",
        "dead_bench_stays" => format!("{}: {}", left(), text("error")),
        code => code.to_owned(),
    }
}

fn versions(finding: &Finding) -> String {
    let text = |name| finding.text(name);
    let preemption = if text("preemption") == "none" { "not preemptible" } else { text("preemption") };
    format!(
        "rotorbench {}, Linux {} ({preemption}, {} Hz), {}, {} processors",
        text("rotorbench"),
        text("kernel"),
        finding.count("tick_hz"),
        text("architecture"),
        finding.count("processors")
    )
}

/// What reading the clock costs.
fn clock(finding: &Finding) -> String {
    let (name, cost) = (finding.text("clock"), finding.count("reading_ns"));
    if cost < 1000 {
        format!("{name}: a reading costs {cost} ns")
    } else {
        format!("{name}: a reading costs {:.1} µs", cost as f64 * 1e-3)
    }
}

/// The one command that mends it.
fn mend(finding: &Finding) -> String {
    let interface = finding.text("interface");
    let rate = finding.count("configured_bit_rate");
    match finding.code {
        "interface_unreadable" if !finding.text("device").is_empty() => {
            format!("sudo ip link set {} up", finding.text("device"))
        }
        "multicast_leaves" => "interface = \"mcast:0\" in the bench file stays on this machine".to_owned(),
        "interface_unreadable" | "interface_down" if interface.starts_with("vcan") => {
            format!("sudo sh -c 'ip link add dev {interface} type vcan; ip link set {interface} up'")
        }
        "interface_unreadable" | "interface_down" => {
            format!("sudo ip link set {interface} up type can bitrate {rate} restart-ms 100")
        }
        "bit_rate_differs" => {
            format!(
                "sudo sh -c 'ip link set {interface} down; ip link set {interface} up type can bitrate {rate}'"
            )
        }
        "restart_off" => format!("sudo ip link set {interface} type can restart-ms 100"),
        "queue_long" => format!("sudo ip link set {interface} txqueuelen 10"),
        "clock_slow" => format!("echo {} | sudo tee {}", finding.text("faster"), finding.text("file")),
        code => fixed_mend(code).to_owned(),
    }
}

/// The command where there is nothing to fill in.
fn fixed_mend(code: &str) -> &'static str {
    match code {
        "can_not_loaded" => "sudo modprobe -a can can_raw vcan",
        "can_not_built" => {
            "interface = \"mcast:0\" in the bench file needs no CAN; tools/vcan COMMAND has a virtual bus inside User-Mode Linux"
        }
        "no_priority" | "lock_too_small" => CAPABILITIES,
        "governor_slow" => {
            "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"
        }
        "shared_memory_missing" => "sudo mount -t tmpfs -o size=256M tmpfs /dev/shm",
        "shared_memory_unreadable" | "shared_memory_full" => "sudo mount -o remount,size=256M /dev/shm",
        "dead_bench" => "rotorbench doctor --fix",
        "dead_bench_stays" => "sudo rotorbench doctor --fix",
        "remove_ipc_on" => {
            "sudo sh -c 'mkdir -p /etc/systemd/logind.conf.d; printf \"[Login]\\nRemoveIPC=no\\n\" > \
             /etc/systemd/logind.conf.d/rotorbench.conf; systemctl restart systemd-logind'"
        }
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dead(bench: String, code: &'static str, grade: Grade) -> MachineCheck {
        let finding = Finding::new(code, "dead benches").with("bench", bench.as_str()).with("files", 2_usize);
        MachineCheck { grade, finding: finding.with("bytes", 4096_usize) }
    }

    #[test]
    fn many_dead_benches_are_one_line() {
        let looked: Vec<MachineCheck> =
            (1..=40).map(|it| dead(format!("b{it}"), "dead_bench", Grade::Warning)).collect();
        let text = |looked: &[MachineCheck]| text(&rows(looked));
        let said = text(&looked);
        let lines: Vec<String> =
            said.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        let folded =
            "warn dead benches 40 benches (`b1`, `b2`, `b3`, ...) have no process and left 80 files, 160 kB";
        assert_eq!(lines, [folded, "→ rotorbench doctor --fix"]);
        let one = text(&looked[..1]);
        assert!(one.contains("bench `b1` has no process and left 2 files, 4 kB\n"), "{one}");
        let removed = [1, 2].map(|it| dead(format!("b{it}"), "dead_bench_removed", Grade::Mended));
        assert!(
            text(&removed)
                .ends_with("2 benches (`b1`, `b2`) have no process and left 4 files, 8 kB: removed\n")
        );
    }
}
