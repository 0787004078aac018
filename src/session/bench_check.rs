//! A bench file, resolved: its messages and signals, how full the bus gets, and what keeps the bench from being armed.

use serde::Serialize;

use crate::bench::{BenchConfig, StepTrigger};
use crate::can::thresholds::THRESHOLDS;
use crate::can::{
    BusConfig, CanError, InterfaceStatus, MessageDescription, MessageLoad, MulticastGroup, NetworkDevice,
    Protocol, SignalDescription, kernel_has_can,
};
use crate::clock::span_s;
use crate::control::ControllerKind;
use crate::guard::Guard;
use crate::model::Model;
use crate::screening::Finding;
use crate::signal::Channel;

/// The resolved bench.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct BenchCheck {
    /// Its name.
    pub bench: String,
    /// [s] control period.
    pub period_s: f64,
    /// Its model: a file, or `paper`.
    pub model: String,
    /// Its controller: `emc` or `pid`.
    pub controller: ControllerKind,
    /// Interface of its bus.
    pub interface: String,
    /// What the kernel says of the interface.
    #[serde(skip)]
    pub interface_look: InterfaceLook,
    /// [bit/s] that the bench file says.
    pub bit_rate: u32,
    /// Messages, sent ones first.
    pub messages: Vec<MessageRow>,
    /// Signals, in the order of their messages.
    pub signals: Vec<SignalRow>,
    /// [%] load of the bus at worst.
    pub bus_load_percent: f64,
    /// Whether rotors are held against what the model makes of their commands.
    pub speed_check: SpeedCheckRow,
    /// What keeps the bench from being armed.
    #[serde(skip)]
    pub obstacles: Vec<Finding>,
    /// What works, less well than it could.
    #[serde(skip)]
    pub caveats: Vec<Finding>,
}

/// Whether rotors are held against what the model makes of their commands.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SpeedCheckRow {
    /// Whether they are.
    pub on: bool,
    /// Whether the bench's model could say what speeds to expect: it was identified from logs, with its errors.
    pub model_is_identified: bool,
    /// [rad/s] off the model at hover from which three readings stop the rotors; `null` where they are not held.
    pub seen_from_rad_s: Option<f64>,
    /// [-] the same as a share of the rate at hover.
    pub seen_from_share: Option<f64>,
    /// [-] lowest and highest command at which they are.
    pub commands: Option<[f64; 2]>,
}

impl SpeedCheckRow {
    fn of(guard: &Guard, model: &Model) -> Self {
        let check = guard.speed_check();
        Self {
            on: check.is_some(),
            model_is_identified: Guard::lacks_for_speed_check(model).is_none(),
            seen_from_rad_s: check.map(|it| it.seen_from),
            seen_from_share: check.map(|it| it.share),
            commands: check.map(|it| [it.commands.0, it.commands.1]),
        }
    }
}

/// What the kernel says of an interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum InterfaceLook {
    /// Nothing: it has no CAN.
    NoCan,
    /// There is none of that name.
    Missing,
    /// Its state.
    There(InterfaceStatus),
    /// The bus is a group of UDP multicast; its device, where there is one of that name.
    Multicast(MulticastGroup, Option<NetworkDevice>),
}

/// A message of the bench.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct MessageRow {
    /// Its name.
    pub message: String,
    /// `sent` or `received`.
    pub direction: &'static str,
    /// Its identifier.
    pub id: String,
    /// [byte] length of its data.
    pub bytes: usize,
    /// [s] how often it comes.
    pub period_s: f64,
    /// Name of its counter, where it has one.
    pub counter: Option<String>,
    /// [bit] on the bus at worst, stuffing included.
    pub worst_case_bits: f64,
    /// [%] of the bus at worst.
    pub load_percent: f64,
}

/// A signal in its role.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct SignalRow {
    /// Key in the bench file.
    pub role: String,
    /// Message and signal.
    pub signal: String,
    /// Number, byte order and first bit.
    pub place: String,
    /// Unit in the DBC file; `-` where it says none.
    pub unit: String,
    /// Unit inside the program.
    pub si_unit: &'static str,
    /// From the raw number to SI.
    pub si_factor: f64,
    /// [SI] added behind the factor.
    pub si_offset: f64,
    /// [SI] least value that is accepted.
    pub minimum: f64,
    /// [SI] greatest value that is accepted.
    pub maximum: f64,
}

impl BenchCheck {
    /// Resolves a bench file whose parts were built. A machine that has not got the interface is not the bench: there the file
    /// is checked alone.
    ///
    /// # Errors
    /// [`CanError`] when the interface is there and does not say what it is.
    pub fn of(
        config: &BenchConfig,
        protocol: &dyn Protocol,
        (guard, model): (&Guard, &Model),
    ) -> Result<Self, CanError> {
        let (spoken, load) = (protocol.messages(), protocol.load(&config.bus));
        let rows = spoken.iter().enumerate().map(|(index, it)| message_row(it, load.messages.get(index)));
        let messages = rows.collect();
        let of_message = |message: &MessageDescription| {
            message.signals.iter().map(|it| signal_row(&message.name, it)).collect::<Vec<_>>()
        };
        let signals = spoken.iter().flat_map(of_message).collect();
        let bus = &config.bus;
        let interface_look = InterfaceLook::at(&bus.interface)?;
        let is_full = load.percent > THRESHOLDS.warning_percent;
        let full = is_full.then(|| {
            Finding::new("bus_loaded", bus.interface.as_str())
                .with("load_percent", load.percent)
                .with("limit_percent", THRESHOLDS.warning_percent)
        });
        let of_interface = interface_findings(config, &interface_look);
        Ok(Self {
            bench: config.name.clone(),
            period_s: config.period_s,
            model: config.model.clone(),
            controller: config.controller.kind,
            interface: bus.interface.clone(),
            bit_rate: bus.bit_rate,
            messages,
            signals,
            bus_load_percent: load.percent,
            speed_check: SpeedCheckRow::of(guard, model),
            obstacles: obstacles(config, &spoken, guard),
            caveats: full
                .into_iter()
                .chain(guard_caveats(config))
                .chain(omitted(config, &spoken, guard))
                .chain(of_interface)
                .collect(),
            interface_look,
        })
    }
}

/// What the bench file takes away from the guard's protection.
fn guard_caveats(config: &BenchConfig) -> Vec<Finding> {
    // What the guard requires by itself, and the file says that it does not.
    let not_required = Channel::WATCHED.into_iter().filter(|channel| {
        let sensor = channel.sensor();
        let is_usual = sensor.guard().is_some_and(|row| row.required);
        is_usual && config.guard.of(sensor).is_some_and(|it| it.required == Some(false))
    });
    let not_required = not_required.map(|channel| Finding::new("not_required", channel.label()));
    let hold_s = config.guard.hold_s;
    let is_long = hold_s > super::thresholds::THRESHOLDS.long_hold_s;
    let long_hold = is_long.then(|| Finding::new("long_hold", "guard.hold_s").with("hold_s", hold_s));
    not_required.chain(long_hold).collect()
}

impl InterfaceLook {
    fn at(interface: &str) -> Result<Self, CanError> {
        // A name that cannot be was refused with the roles.
        if let Some(Ok(group)) = MulticastGroup::parse(interface) {
            let device = group.look()?;
            return Ok(Self::Multicast(group, device));
        }
        if !kernel_has_can() {
            return Ok(Self::NoCan);
        }
        Ok(InterfaceStatus::find(interface)?.map_or(Self::Missing, Self::There))
    }
}

fn message_row(message: &MessageDescription, load: Option<&MessageLoad>) -> MessageRow {
    MessageRow {
        message: message.name.clone(),
        direction: if message.is_sent { "sent" } else { "received" },
        id: message.id.to_string(),
        bytes: message.bytes,
        period_s: message.period_s,
        counter: message.counter.clone(),
        worst_case_bits: load.map_or(0.0, |load| load.bits),
        load_percent: load.map_or(0.0, |load| load.percent),
    }
}

fn signal_row(message: &str, signal: &SignalDescription) -> SignalRow {
    SignalRow {
        role: signal.role.clone(),
        signal: format!("{message}.{}", signal.name),
        place: signal.place.clone(),
        unit: if signal.unit.is_empty() { "-".to_owned() } else { signal.unit.clone() },
        si_unit: signal.si_unit,
        si_factor: signal.factor,
        si_offset: signal.offset,
        minimum: signal.range.0,
        maximum: signal.range.1,
    }
}

/// What the guard needs and the bus does not bring, or brings too rarely: such a bench is never
/// armed, or not for long.
fn obstacles(config: &BenchConfig, spoken: &[MessageDescription], guard: &Guard) -> Vec<Finding> {
    let mut obstacles = Vec::new();
    for (channel, stale_after_ns) in guard.requirements() {
        let feeds = |it: &&MessageDescription| it.signals.iter().any(|it| it.channel == Some(channel));
        let route = spoken.iter().find(feeds);
        // Half of what a signal may be silent for is a miss already.
        let missed_after_s = span_s(stale_after_ns / 2);
        let about = |code, route: &MessageDescription| {
            Finding::new(code, channel.label())
                .with("message", route.name.as_str())
                .with("message_period_s", route.period_s)
        };
        match route {
            None => {
                obstacles.push(
                    Finding::new("no_signal_feeds", channel.label()).with("bench", config.name.as_str()),
                );
            }
            Some(route) if route.lacks_node => obstacles.push(node_not_named(route)),
            Some(route) if route.period_s > missed_after_s => {
                obstacles.push(about("message_too_rare", route).with("missed_after_s", missed_after_s));
            }
            Some(route)
                if channel == Channel::BodyRate
                    && config.trigger == StepTrigger::Imu
                    && !is_whole(config.period_s / route.period_s) =>
            {
                obstacles.push(about("trigger_off_rate", route).with("period_s", config.period_s));
            }
            Some(_) => {}
        }
    }
    obstacles
}

fn node_not_named(message: &MessageDescription) -> Finding {
    Finding::new("node_not_named", message.name.as_str()).with("id", message.id.to_string())
}

/// What the bench file omits, and somebody who changed it from another may not have meant so: a node, and the counters of
/// messages that are not those of the built-in bench.
fn omitted(config: &BenchConfig, spoken: &[MessageDescription], guard: &Guard) -> Vec<Finding> {
    let is_required = |it: &&MessageDescription| {
        let mut channels = it.signals.iter().filter_map(|it| it.channel);
        channels.any(|channel| guard.requirements().any(|(required, _)| required == channel))
    };
    // Without one that the guard requires the bench could never be armed: an obstacle.
    let nodeless = spoken.iter().filter(|it| it.lacks_node && !is_required(it));
    let mut found: Vec<Finding> = nodeless.map(node_not_named).collect();
    let counted = BusConfig::default().messages;
    let is_used = |name: &str| spoken.iter().any(|it| it.name == name);
    let unused: Vec<String> = counted.keys().filter(|name| !is_used(name)).cloned().collect();
    let uncounted = spoken.iter().filter(|it| it.may_have_counter && !counted.contains_key(&it.name));
    let uncounted: Vec<String> = uncounted.map(|it| it.name.clone()).collect();
    // Only where the table was left out, or left as it was.
    if config.bus.messages == counted && !unused.is_empty() && !uncounted.is_empty() {
        found.push(
            Finding::new("counters_of_other_messages", uncounted.join(", "))
                .with("unused", unused.join(", ")),
        );
    }
    found
}

/// Whether a ratio of rates is 1, 2, 3, ..., to a hundredth.
fn is_whole(ratio: f64) -> bool {
    ratio.round() >= 1.0 && (ratio - ratio.round()).abs() <= super::thresholds::THRESHOLDS.whole_ratio * ratio
}

/// What of the interface is not as the bench file has it.
fn interface_findings(config: &BenchConfig, look: &InterfaceLook) -> Vec<Finding> {
    let bus = &config.bus;
    let found = |code| Finding::new(code, bus.interface.as_str());
    let status = match look {
        InterfaceLook::NoCan => return Vec::new(),
        InterfaceLook::Missing => return vec![found("interface_missing")],
        InterfaceLook::Multicast(group, device) => return device_findings(group, device.as_ref()),
        InterfaceLook::There(status) => status,
    };
    let mut findings = Vec::new();
    if !status.is_up {
        findings.push(found("interface_down"));
    }
    if bus.fd && !status.fd {
        findings.push(found("no_fd_frames"));
    }
    if let Some(rate) = status.bit_rate.filter(|rate| *rate != bus.bit_rate) {
        findings.push(
            found("bit_rate_differs")
                .with("bit_rate", rate as usize)
                .with("configured_bit_rate", bus.bit_rate as usize),
        );
    }
    if status.state.is_some() && status.restart_ms == Some(0) {
        findings.push(found("restart_off"));
    }
    findings
}

/// What of the device that carries a group of multicast is not as it should be.
fn device_findings(group: &MulticastGroup, device: Option<&NetworkDevice>) -> Vec<Finding> {
    let found = |code| Finding::new(code, group.device.as_str());
    let Some(device) = device else { return vec![found("interface_missing")] };
    let is_down = (!device.is_up).then(|| found("interface_down"));
    let is_open = (!device.is_loopback).then(|| found("multicast_leaves_machine"));
    is_down.into_iter().chain(is_open).collect()
}

#[cfg(test)]
mod tests;
