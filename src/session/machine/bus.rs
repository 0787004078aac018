//! The bus: CAN in the kernel, the interface and its settings.

use std::fs;

use super::check::{MachineCheck, bad, good, warning};
use crate::can::{BusConfig, InterfaceStatus, MulticastGroup, kernel_has_can, timestamps};
use crate::session::thresholds::THRESHOLDS;

pub(super) fn look(bus: &BusConfig) -> Vec<MachineCheck> {
    let interface = bus.interface.as_str();
    if let Some(Ok(group)) = MulticastGroup::parse(interface) {
        return vec![device(&group)];
    }
    if !kernel_has_can() {
        return vec![no_can()];
    }
    let mut findings = vec![good("CAN in the kernel", "can_there")];
    let of_interface = |looked: MachineCheck| {
        looked.with("interface", interface).with("configured_bit_rate", bus.bit_rate as usize)
    };
    let status = match InterfaceStatus::read(interface) {
        Ok(status) => status,
        Err(error) => {
            let unreadable = bad("interface", "interface_unreadable").with("error", error.to_string());
            findings.push(of_interface(unreadable));
            return findings;
        }
    };
    findings.push(of_interface(if status.is_up {
        good("interface", "interface_up")
    } else {
        bad("interface", "interface_down")
    }));
    match status.bit_rate {
        Some(real) => {
            let looked = if real == bus.bit_rate {
                good("bit rate", "bit_rate_as_configured")
            } else {
                bad("bit rate", "bit_rate_differs")
            };
            findings.push(of_interface(looked.with("bit_rate", real as usize)));
            findings.push(of_interface(restart(&status)));
        }
        None => findings.push(of_interface(good("bit rate", "bit_rate_of_virtual"))),
    }
    findings.push(of_interface(queue(interface)));
    findings.push(of_interface(stamps(interface)));
    findings
}

/// The device of a bus that needs no CAN.
fn device(group: &MulticastGroup) -> MachineCheck {
    const CHECK: &str = "UDP multicast";
    let looked = match group.ready() {
        Ok(device) if device.is_loopback => good(CHECK, "multicast_stays"),
        Ok(_) => warning(CHECK, "multicast_leaves"),
        Err(error) => bad(CHECK, "interface_unreadable").with("error", error.to_string()),
    };
    looked.with("interface", group.to_string()).with("device", group.device.as_str())
}

fn no_can() -> MachineCheck {
    const CHECK: &str = "CAN in the kernel";
    let release = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let modules = format!("/lib/modules/{}/kernel/net/can", release.trim());
    if fs::exists(modules).unwrap_or(false) {
        return bad(CHECK, "can_not_loaded");
    }
    bad(CHECK, "can_not_built").with("kernel", release.trim())
}

fn restart(status: &InterfaceStatus) -> MachineCheck {
    match status.restart_ms {
        Some(milliseconds) if milliseconds > 0 => {
            good("restart-ms", "restart_on").with("restart_ms", milliseconds as usize)
        }
        _ => warning("restart-ms", "restart_off"),
    }
}

fn queue(interface: &str) -> MachineCheck {
    const CHECK: &str = "txqueuelen";
    let text = fs::read_to_string(format!("/sys/class/net/{interface}/tx_queue_len")).unwrap_or_default();
    match text.trim().parse::<u32>() {
        Ok(length) if length <= THRESHOLDS.longest_queue => {
            good(CHECK, "queue_short").with("frames", length as usize)
        }
        Ok(length) => warning(CHECK, "queue_long").with("frames", length as usize),
        Err(_) => good(CHECK, "kernel_does_not_say"),
    }
}

fn stamps(interface: &str) -> MachineCheck {
    const CHECK: &str = "timestamps";
    match timestamps(interface) {
        Some(stamps) if stamps.hardware => good(CHECK, "stamps_of_adapter"),
        Some(stamps) if stamps.software => good(CHECK, "stamps_of_kernel"),
        _ => good(CHECK, "stamps_unknown"),
    }
}
