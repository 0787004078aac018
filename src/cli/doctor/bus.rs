//! The bus: CAN in the kernel, the interface and its settings.

use std::fs;

use super::Finding;
use crate::can::{BusConfig, InterfaceStatus, kernel_has_can, timestamps};
use crate::cli::thresholds::THRESHOLDS;

pub(super) fn findings(bus: &BusConfig) -> Vec<Finding> {
    let interface = &bus.interface;
    if !kernel_has_can() {
        return vec![no_can()];
    }
    let mut findings = vec![Finding::good("CAN in the kernel", "it is there")];
    let status = match InterfaceStatus::read(interface) {
        Ok(status) => status,
        Err(error) => {
            findings.push(Finding::bad("interface", error.to_string(), bring_up(bus)));
            return findings;
        }
    };
    findings.push(if status.is_up {
        Finding::good("interface", format!("{interface} is up"))
    } else {
        Finding::bad("interface", format!("{interface} is down"), bring_up(bus))
    });
    if status.bit_rate.is_some() {
        findings.push(bit_rate(bus, &status));
        findings.push(restart(interface, &status));
    } else {
        findings.push(Finding::good("bit rate", format!("{interface} is virtual: it has none")));
    }
    findings.push(queue(interface));
    findings.push(stamps(interface));
    findings
}

fn no_can() -> Finding {
    const CHECK: &str = "CAN in the kernel";
    let release = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let modules = format!("/lib/modules/{}/kernel/net/can", release.trim());
    if fs::exists(modules).unwrap_or(false) {
        return Finding::bad(CHECK, "not loaded, but there as modules", "sudo modprobe -a can can_raw vcan");
    }
    let found =
        format!("kernel {} was built without it: no bus, real or virtual, can be opened", release.trim());
    Finding::bad(CHECK, found, "tools/vcan COMMAND (runs a command on a virtual bus inside User-Mode Linux)")
}

fn bring_up(bus: &BusConfig) -> String {
    let BusConfig { interface, bit_rate, .. } = bus;
    if interface.starts_with("vcan") {
        return format!("sudo sh -c 'ip link add dev {interface} type vcan; ip link set {interface} up'");
    }
    format!("sudo ip link set {interface} up type can bitrate {bit_rate} restart-ms 100")
}

fn bit_rate(bus: &BusConfig, status: &InterfaceStatus) -> Finding {
    let real = status.bit_rate.unwrap_or(0);
    let (interface, wanted) = (&bus.interface, bus.bit_rate);
    if real == wanted {
        return Finding::good("bit rate", format!("{real} bit/s, as the bench file says"));
    }
    let found =
        format!("{interface} runs at {real} bit/s; the bench file says {wanted}: one of them is wrong");
    let mend = format!(
        "sudo sh -c 'ip link set {interface} down; ip link set {interface} up type can bitrate {wanted}'"
    );
    Finding::bad("bit rate", found, mend)
}

fn restart(interface: &str, status: &InterfaceStatus) -> Finding {
    match status.restart_ms {
        Some(milliseconds) if milliseconds > 0 => {
            Finding::good("restart-ms", format!("{milliseconds} ms after bus off the controller comes back"))
        }
        _ => Finding::warning(
            "restart-ms",
            "0: after bus off the controller stays off until somebody restarts it",
            format!("sudo ip link set {interface} type can restart-ms 100"),
        ),
    }
}

fn queue(interface: &str) -> Finding {
    let text = fs::read_to_string(format!("/sys/class/net/{interface}/tx_queue_len")).unwrap_or_default();
    match text.trim().parse::<u32>() {
        Ok(length) if length <= THRESHOLDS.longest_queue => {
            Finding::good("txqueuelen", format!("{length}: no more stale commands than that after a stall"))
        }
        Ok(length) => Finding::warning(
            "txqueuelen",
            format!("{length}: after a stall up to {length} stale commands would still leave"),
            format!("sudo ip link set {interface} txqueuelen 10"),
        ),
        Err(_) => Finding::good("txqueuelen", "the kernel does not say"),
    }
}

fn stamps(interface: &str) -> Finding {
    const CHECK: &str = "timestamps";
    match timestamps(interface) {
        Some(stamps) if stamps.hardware => Finding::good(CHECK, "the adapter stamps frames itself"),
        Some(stamps) if stamps.software => {
            Finding::good(CHECK, "the kernel stamps frames on arrival; the adapter does not")
        }
        _ => Finding::good(CHECK, "the interface does not say; the kernel stamps frames on arrival"),
    }
}
