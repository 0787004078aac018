//! `rotorbench check`: resolve and check a bench file: signals, units, bus load.

use serde::Serialize;

use super::operate::BenchArguments;
use super::{CliResult, Outcome};
use crate::bench::{BenchConfig, Trigger};
use crate::can::{
    Binding, BusLoad, ByteOrder, InterfaceStatus, Number, Roles, Route, WARNING_PERCENT, kernel_has_can,
    worst_case,
};
use crate::clock::span_s;
use crate::guard::Guard;
use crate::report::Table;
use crate::runtime::{controller_plant, emulate};
use crate::shm::Place;
use crate::signal::Channel;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Instead: print a commented bench file to start from
    #[arg(long, value_name = "BENCH", num_args = 0..=1, default_missing_value = "bench", conflicts_with_all = ["config", "json"])]
    template: Option<Template>,
    /// Write the result as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// A bench file to start from; the same are in `examples/benches/`.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Template {
    /// The bench that is built in, every usual key with its default
    Bench,
    /// Two VESCs and an IMU
    Vesc,
    /// Two ODrives and an IMU
    Odrive,
}

impl Template {
    fn text(self) -> &'static str {
        match self {
            Self::Bench => include_str!("../../examples/benches/bench.toml"),
            Self::Vesc => include_str!("../../examples/benches/vesc.toml"),
            Self::Odrive => include_str!("../../examples/benches/odrive.toml"),
        }
    }
}

/// The resolved bench.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub(super) struct Resolved {
    bench: String,
    period_s: f64,
    interface: String,
    interface_state: String,
    bit_rate: u32,
    messages: Vec<MessageRow>,
    signals: Vec<SignalRow>,
    bus_load_percent: f64,
    /// What keeps the bench from being armed.
    obstacles: Vec<String>,
    warnings: Vec<String>,
}

/// A message of the bench.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
struct MessageRow {
    message: String,
    direction: &'static str,
    id: String,
    bytes: usize,
    period_s: f64,
    counter: Option<String>,
    worst_case_bits: f64,
    load_percent: f64,
}

/// A signal in its role.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
struct SignalRow {
    role: String,
    signal: String,
    place: String,
    unit: String,
    si_unit: &'static str,
    si_factor: f64,
    si_offset: f64,
    minimum: f64,
    maximum: f64,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    if let Some(template) = arguments.template {
        print!("{}", template.text());
        return Ok(Outcome::Done);
    }
    let config = arguments.bench.load()?;
    let roles = Roles::build(&config.bus, config.period_s)?;
    let guard = config.guard.build(config.period_s)?;
    controller_plant::pilot(&config)?;
    config.real_time.check()?;
    emulate::emulator(&config)?;
    Place::check_name(&config.name)?;
    let resolved = resolve(&config, &roles, &guard)?;
    if arguments.json {
        println!("{}", crate::report::json::answer(&resolved)?);
    } else {
        print!("{}", text(&resolved));
    }
    resolved.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    resolved.obstacles.iter().for_each(|obstacle| eprintln!("found wanting: {obstacle}"));
    Ok(if resolved.obstacles.is_empty() { Outcome::Done } else { Outcome::FoundWanting })
}

fn resolve(config: &BenchConfig, roles: &Roles, guard: &Guard) -> Result<Resolved, super::CliError> {
    let load = worst_case(roles, &config.bus);
    let mut messages = Vec::new();
    let mut signals = Vec::new();
    for route in roles.command_messages() {
        messages.push(message_row(route, "sent", &load, messages.len()));
        signals.extend(route.bindings().iter().map(|binding| {
            signal_row(route, binding, format!("commands.{}", binding.field), binding.field.si())
        }));
    }
    for route in roles.sensor_messages() {
        messages.push(message_row(route, "received", &load, messages.len()));
        signals.extend(route.bindings().iter().map(|binding| {
            signal_row(route, binding, format!("sensors.{}", binding.field), binding.field.unit())
        }));
    }
    let mut warnings = Vec::new();
    if load.percent > WARNING_PERCENT {
        warnings.push(format!(
            "the bus is {:.1} % loaded at worst, over {WARNING_PERCENT:.0} %: retransmissions and other nodes have \
             little room",
            load.percent
        ));
    }
    Ok(Resolved {
        bench: config.name.clone(),
        period_s: config.period_s,
        interface: config.bus.interface.clone(),
        interface_state: interface_state(config, &mut warnings)?,
        bit_rate: config.bus.bit_rate,
        messages,
        signals,
        bus_load_percent: load.percent,
        obstacles: obstacles(config, roles, guard),
        warnings,
    })
}

fn message_row<F: Copy>(
    route: &Route<F>,
    direction: &'static str,
    load: &BusLoad,
    index: usize,
) -> MessageRow {
    let load = load.messages.get(index);
    MessageRow {
        message: route.name.clone(),
        direction,
        id: route.id.to_string(),
        bytes: route.length,
        period_s: route.period_s,
        counter: route.counter.as_ref().map(|(name, _)| name.clone()),
        worst_case_bits: load.map_or(0.0, |load| load.bits),
        load_percent: load.map_or(0.0, |load| load.percent),
    }
}

fn signal_row<F: Copy>(
    route: &Route<F>,
    binding: &Binding<F>,
    role: String,
    si_unit: &'static str,
) -> SignalRow {
    let layout = binding.codec.layout();
    let order = if layout.order == ByteOrder::Little { "little" } else { "big" };
    let number = match layout.number {
        Number::Unsigned => format!("u{}", layout.size),
        Number::Signed => format!("i{}", layout.size),
        Number::Float32 => "f32".to_owned(),
        Number::Float64 => "f64".to_owned(),
    };
    SignalRow {
        role,
        signal: format!("{}.{}", route.name, binding.signal),
        place: format!("{number} {order} at {}", layout.start),
        unit: if binding.unit.is_empty() { "-".to_owned() } else { binding.unit.clone() },
        si_unit,
        si_factor: binding.codec.factor() * binding.scale,
        si_offset: binding.codec.offset() * binding.scale + binding.offset,
        minimum: binding.range.0,
        maximum: binding.range.1,
    }
}

/// What the guard needs and the bus does not bring, or brings too rarely: such a bench is never
/// armed, or not for long.
fn obstacles(config: &BenchConfig, roles: &Roles, guard: &Guard) -> Vec<String> {
    let mut obstacles = Vec::new();
    for (channel, stale_after_ns) in guard.requirements() {
        let feeds = |route: &&Route<Channel>| route.bindings().iter().any(|it| it.field == channel);
        let route = roles.sensor_messages().iter().find(feeds);
        let signal = channel.label();
        // Half of what a signal may be silent for is a miss already.
        let missed_after_s = span_s(stale_after_ns / 2);
        match route {
            None => obstacles.push(format!(
                "the guard requires {signal}, and no signal of bus.sensors feeds it: `{}` could never be armed",
                config.name
            )),
            Some(route) if route.period_s > missed_after_s => obstacles.push(format!(
                "{signal} comes with `{}` every {} s, and the guard misses it after {missed_after_s} s",
                route.name, route.period_s
            )),
            Some(route)
                if channel == Channel::BodyRate
                    && config.trigger == Trigger::Imu
                    && !is_whole(config.period_s / route.period_s) =>
            {
                obstacles.push(format!(
                    "trigger = \"imu\" steps the controller with the `{}` nearest to period_s = {} s, and it comes every \
                     {} s: not at the control rate, nor at a multiple of it",
                    route.name, config.period_s, route.period_s
                ));
            }
            Some(_) => {}
        }
    }
    obstacles
}

/// Whether a ratio of rates is 1, 2, 3, ..., to a hundredth.
fn is_whole(ratio: f64) -> bool {
    ratio.round() >= 1.0 && (ratio - ratio.round()).abs() <= 0.01 * ratio
}

/// What the kernel says of the interface. A machine whose kernel has no CAN at all is not the bench: there the file
/// is checked alone.
fn interface_state(config: &BenchConfig, warnings: &mut Vec<String>) -> Result<String, super::CliError> {
    let bus = &config.bus;
    if !kernel_has_can() {
        return Ok("not looked for: this kernel has no CAN".to_owned());
    }
    let status = InterfaceStatus::read(&bus.interface)?;
    if !status.is_up {
        warnings.push(format!("{0} is down (sudo ip link set {0} up)", bus.interface));
    }
    if bus.fd && !status.fd {
        warnings.push(format!("{0} carries no FD frames (sudo ip link set {0} mtu 72)", bus.interface));
    }
    if let Some(rate) = status.bit_rate.filter(|rate| *rate != bus.bit_rate) {
        warnings
            .push(format!("{} runs at {rate} bit/s, and bus.bit_rate says {}", bus.interface, bus.bit_rate));
    }
    if status.state.is_some() && status.restart_ms == Some(0) {
        let mend = format!("sudo ip link set {} type can restart-ms 100", bus.interface);
        warnings.push(format!("{} stays off the bus after a bus-off (restart-ms 0: {mend})", bus.interface));
    }
    let state = status.state.map_or_else(|| "virtual".to_owned(), |state| format!("{state:?}"));
    Ok(format!("{}, {state}", if status.is_up { "up" } else { "down" }))
}

fn text(resolved: &Resolved) -> String {
    let mut messages = Table::new([
        "message",
        "direction",
        "id",
        "bytes",
        "period [ms]",
        "counter",
        "bits at worst",
        "load [%]",
    ]);
    for row in &resolved.messages {
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
    let mut signals =
        Table::new(["role", "signal", "bits", "unit", "SI", "factor to SI", "offset", "least", "greatest"]);
    for row in &resolved.signals {
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
        "bench `{}`, control period {} ms, bus {} ({}) at {} bit/s\n\n{}\n{}\nworst-case bus load {:.1} %\n",
        resolved.bench,
        round(resolved.period_s * 1e3),
        resolved.interface,
        resolved.interface_state,
        resolved.bit_rate,
        messages.text(),
        signals.text(),
        resolved.bus_load_percent
    )
}

/// To six digits, for people.
fn round(value: f64) -> f64 {
    // Adding zero turns -0 into 0.
    format!("{value:.5e}").parse().unwrap_or(value) + 0.0
}
