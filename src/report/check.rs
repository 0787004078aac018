//! What `check` says of a bench file.

use serde::Serialize;

use super::TextTable;
use crate::control::ControllerKind;
use crate::screening::Finding;
use crate::session::{BenchCheck, InterfaceLook, SpeedCheckRow};

/// The answer of `check --json`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct CheckAnswer<'a> {
    #[serde(flatten)]
    check: &'a BenchCheck,
    /// What the kernel says of the interface.
    interface_state: String,
    /// What keeps the bench from being armed.
    obstacles: Vec<String>,
    /// What works, less well than it could.
    warnings: Vec<String>,
    /// The obstacles, then the warnings, as codes.
    findings: Vec<&'a Finding>,
}

/// The resolved bench for a script.
#[must_use]
pub fn answer(check: &BenchCheck) -> CheckAnswer<'_> {
    CheckAnswer {
        interface_state: interface_state(check),
        obstacles: check.obstacles.iter().map(sentence).collect(),
        warnings: check.caveats.iter().map(sentence).collect(),
        findings: check.obstacles.iter().chain(&check.caveats).collect(),
        check,
    }
}

/// What the kernel says of the interface.
fn interface_state(check: &BenchCheck) -> String {
    let status = match &check.interface_look {
        InterfaceLook::NoCan => return "not looked for: this kernel has no CAN".to_owned(),
        InterfaceLook::Missing => return "not there".to_owned(),
        InterfaceLook::Multicast(group, device) => {
            let state = device.map_or("not there", |device| if device.is_up { "up" } else { "down" });
            return format!("UDP multicast {} on {}, {state}", group.address(), group.device);
        }
        InterfaceLook::There(status) => status,
    };
    let state = status.state.as_ref().map_or_else(|| "virtual".to_owned(), |state| format!("{state:?}"));
    format!("{}, {state}", if status.is_up { "up" } else { "down" })
}

/// The sentence of an obstacle or a caveat.
#[must_use]
pub fn sentence(finding: &Finding) -> String {
    let (subject, number) = (&finding.subject, |name| finding.number(name));
    match finding.code {
        "bus_loaded" => format!(
            "the bus is {:.1} % loaded at worst, over {:.0} %: retransmissions and other nodes have little room",
            number("load_percent"),
            number("limit_percent")
        ),
        "node_not_named" => format!(
            "`{subject}` has the identifier of its DBC file, {}: that file has a node_mask, and the role names no node (`node = 0` \
             says that node 0 is meant)",
            finding.text("id")
        ),
        "counters_of_other_messages" => format!(
            "no counter is looked at in {subject}: bus.messages names those of the built-in bench, and no role uses {}; name your \
             messages' counters there, or an empty table `[bus.messages]`",
            finding.text("unused")
        ),
        "interface_missing" => {
            format!("{subject} is not on this machine: its state and its bit rate are not checked")
        }
        "multicast_leaves_machine" => format!(
            "frames go out on {subject} in datagrams: whoever is in that network can command the rotors, and hears them"
        ),
        "interface_down" => format!("{subject} is down (sudo ip link set {subject} up)"),
        "no_fd_frames" => format!("{subject} carries no FD frames (sudo ip link set {subject} mtu 72)"),
        "bit_rate_differs" => format!(
            "{subject} runs at {} bit/s, and bus.bit_rate says {}",
            finding.count("bit_rate"),
            finding.count("configured_bit_rate")
        ),
        "restart_off" => format!(
            "{subject} stays off the bus after a bus-off (restart-ms 0: sudo ip link set {subject} type can restart-ms 100)"
        ),
        "not_required" => format!(
            "the guard does not require {subject}: the rotors turn on when that signal is silent, frozen or out of range \
             (guard.{}.required)",
            subject.split(' ').next().unwrap_or(subject)
        ),
        "long_hold" => format!(
            "{subject} = {}: when a signal is lost or the controller ends, the rotors keep their last command for {0} s before they \
             are ramped to zero",
            number("hold_s")
        ),
        "no_signal_feeds" => format!(
            "the guard requires {subject}, and no signal of bus.sensors feeds it: `{}` could never be armed",
            finding.text("bench")
        ),
        "message_too_rare" => format!(
            "{subject} comes with `{}` every {} s, and the guard misses it after {} s",
            finding.text("message"),
            number("message_period_s"),
            number("missed_after_s")
        ),
        "trigger_off_rate" => format!(
            "trigger = \"imu\" steps the controller with the `{}` nearest to period_s = {} s, and it comes every {} s: not at \
             the control rate, nor at a multiple of it",
            finding.text("message"),
            number("period_s"),
            number("message_period_s")
        ),
        code => format!("{code} {subject}"),
    }
}

/// The messages of a bench, one a row.
fn message_table(check: &BenchCheck) -> TextTable {
    let mut messages = TextTable::new([
        "message",
        "direction",
        "id",
        "bytes",
        "period [ms]",
        "counter",
        "bits at worst",
        "load [%]",
    ]);
    for row in &check.messages {
        messages = messages.row([
            row.message.clone(),
            row.direction.to_owned(),
            row.id.clone(),
            row.bytes.to_string(),
            format!("{}", round(row.period_s * 1e3)),
            row.counter.clone().unwrap_or_default(),
            format!("{:.0}", row.worst_case_bits),
            format!("{:.2}", row.load_percent),
        ]);
    }
    messages
}

/// The resolved bench as tables.
#[must_use]
pub fn text(check: &BenchCheck) -> String {
    let mut signals = TextTable::new([
        "role",
        "signal",
        "bits",
        "unit",
        "SI",
        "factor to SI",
        "offset",
        "least",
        "greatest",
    ]);
    for row in &check.signals {
        signals = signals.row([
            row.role.clone(),
            row.signal.clone(),
            row.place.clone(),
            row.unit.clone(),
            row.si_unit.to_owned(),
            format!("{}", round(row.si_factor)),
            format!("{}", round(row.si_offset)),
            format!("{}", round(row.minimum)),
            format!("{}", round(row.maximum)),
        ]);
    }
    format!(
        "bench `{}`, control period {} ms, bus {} ({}) at {} bit/s\nmodel {}, controller {}\n{}\n\n{}\n{}\nworst-case bus load {:.1} %\n",
        check.bench,
        round(check.period_s * 1e3),
        check.interface,
        interface_state(check),
        check.bit_rate,
        model(&check.model),
        controller(check.controller),
        speed_check(&check.speed_check),
        message_table(check).text(),
        signals.text(),
        check.bus_load_percent
    )
}

fn controller(kind: ControllerKind) -> &'static str {
    match kind {
        ControllerKind::Emc => "EMC",
        ControllerKind::Pid => "PID",
    }
}

/// Whether rotors are held against their commands, and why not.
fn speed_check(row: &SpeedCheckRow) -> String {
    match (row.seen_from_rad_s, row.seen_from_share, row.commands) {
        (Some(off), Some(share), Some([lowest, highest])) => format!(
            "rotor speeds are held against the model: at hover, three readings off by {off:.0} rad/s ({:.1} %) stop the rotors; at \
             commands from {lowest:.2} to {highest:.2}",
            100.0 * share
        ),
        _ if row.model_is_identified => {
            "rotor speeds are not held against the model: guard.speed_check is off, and this model allows it (`on = true`)"
                .to_owned()
        }
        _ => "rotor speeds are not held against the model: guard.speed_check is off, and needs a model that was identified on this \
              bench"
            .to_owned(),
    }
}

/// The model that the controller's gains and the guard's limits are for.
fn model(name: &str) -> String {
    let is_paper = name == "paper";
    format!(
        "`{name}`{}",
        if is_paper { " (the paper's bench: before you arm another one, identify it)" } else { "" }
    )
}

/// To six digits, for people.
fn round(value: f64) -> f64 {
    // Adding zero turns -0 into 0.
    format!("{value:.5e}").parse().unwrap_or(value) + 0.0
}
