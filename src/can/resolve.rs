//! From the `[bus]` table and its DBC files to [`Roles`]: every name is looked up once, here, and whatever does
//! not fit is said with its place in the table.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

use crate::file::read_settings;
use crate::signal::Channel;
use crate::unit::Unit;

use super::codec::SignalCodec;
use super::config::{BusConfig, DatabaseConfig, SignalConfig};
use super::database::{Database, Message, Signal, needs_fd};
use super::error::CanError;
use super::field::CommandField;
use super::frame::Id;
use super::layout::NumberFormat;
use super::load;
use super::multicast::MulticastGroup;
use super::roles::Roles;
use super::route::{Binding, Route, Routes};
use super::thresholds::THRESHOLDS;

#[cfg(test)]
mod tests;

/// The DBC files that come with the crate, by the name a bench file uses.
const BUILT_IN: [(&str, &str); 3] = [
    ("bench", include_str!("../../dbc/bench.dbc")),
    ("vesc", include_str!("../../dbc/vesc.dbc")),
    ("odrive", include_str!("../../dbc/odrive.dbc")),
];

impl DatabaseConfig {
    /// The bytes of the DBC file: what somebody needs to understand recorded frames later.
    ///
    /// # Errors
    /// [`CanError::Read`].
    pub fn bytes(&self) -> Result<Vec<u8>, CanError> {
        match BUILT_IN.iter().find(|(name, _)| *name == self.file) {
            Some((_, text)) => Ok(text.as_bytes().to_vec()),
            None => read_settings(Path::new(&self.file))
                .map_err(|source| CanError::Read { file: self.file.clone(), source }),
        }
    }
}

/// Loads the DBC files of the table, in its order.
///
/// # Errors
/// What [`Database::load`] says.
fn load(config: &BusConfig) -> Result<Vec<Database>, CanError> {
    let load = |database: &DatabaseConfig| match BUILT_IN.iter().find(|(name, _)| *name == database.file) {
        Some((name, text)) => Database::parse(&format!("{name}.dbc (built in)"), text.as_bytes()),
        None => Database::load(Path::new(&database.file)),
    };
    config.database.iter().map(load).collect()
}

impl Roles {
    /// Loads the DBC files and finds every signal the roles name. `period_s` is the control period, the period of
    /// every message that names none.
    ///
    /// # Errors
    /// What loading says, [`CanError::Role`] for a role that cannot be filled, and [`CanError::Overload`] when
    /// the frames cannot all be on the bus.
    pub fn build(config: &BusConfig, period_s: f64) -> Result<Self, CanError> {
        Self::resolve(config, &load(config)?, period_s)
    }

    /// The same with DBC files already loaded, in the order of `config.database`.
    ///
    /// # Errors
    /// See [`Self::build`].
    pub fn resolve(config: &BusConfig, databases: &[Database], period_s: f64) -> Result<Self, CanError> {
        check_interface(config)?;
        let resolver = Resolver { config, databases, period_s };
        for field in [CommandField::Rotor1, CommandField::Rotor2] {
            if !config.commands.contains_key(&field) {
                return Err(fail(
                    format!("commands.{field}"),
                    "no signal carries this rotor's command".to_owned(),
                ));
            }
        }
        let sensors = resolver.routes(
            "sensors",
            config.sensors.iter().map(|(field, signal)| (*field, signal)),
            Channel::unit,
        )?;
        let commands = resolver.routes(
            "commands",
            config.commands.iter().map(|(field, signal)| (*field, signal)),
            CommandField::si,
        )?;
        check_commands(&commands)?;
        for command in &commands {
            if let Some(sensor) = sensors.iter().find(|sensor| sensor.id == command.id) {
                let reason = format!("`{}` is also received, as `{}`", command.name, sensor.name);
                return Err(fail("commands", reason));
            }
        }
        resolver.check_messages()?;
        let roles = Roles { sensors: Routes::new(sensors), commands: Routes::new(commands) };
        let percent = load::worst_case(&roles, config).percent;
        if percent > THRESHOLDS.maximum_percent {
            return Err(CanError::Overload { percent, limit: THRESHOLDS.maximum_percent });
        }
        Ok(roles)
    }
}

/// The interface must have a name that an interface can have.
pub(super) fn check_interface(config: &BusConfig) -> Result<(), CanError> {
    if let Some(group) = MulticastGroup::parse(&config.interface) {
        return group.map(drop).map_err(|reason| fail("interface", reason));
    }
    if config.interface.is_empty() || config.interface.len() >= libc::IFNAMSIZ {
        let reason = format!("`{}` cannot be the name of an interface", config.interface);
        return Err(fail("interface", reason));
    }
    Ok(())
}

pub(super) fn fail(place: impl Into<String>, reason: String) -> CanError {
    CanError::Role { place: place.into(), reason }
}

struct Resolver<'a> {
    config: &'a BusConfig,
    databases: &'a [Database],
    period_s: f64,
}

impl<'a> Resolver<'a> {
    /// The messages that the roles of one table need.
    fn routes<F: Copy + PartialEq + Display>(
        &self,
        table: &str,
        roles: impl Iterator<Item = (F, &'a SignalConfig)>,
        si: fn(F) -> &'static str,
    ) -> Result<Vec<Route<F>>, CanError> {
        let mut routes: BTreeMap<Id, Route<F>> = BTreeMap::new();
        for (field, role) in roles {
            let place = format!("{table}.{field}");
            let (message, signal, id, lacks_node) = self.find(&place, role)?;
            let binding = bind(field, message, signal, role, si(field))
                .map_err(|reason| fail(place.clone(), format!("`{}`: {reason}", role.signal)))?;
            let route = match routes.entry(id) {
                std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
                std::collections::btree_map::Entry::Vacant(entry) => {
                    entry.insert(self.route(&place, message, role.node, id)?)
                }
            };
            route.lacks_node = lacks_node;
            if route.counter.as_ref().is_some_and(|(name, _)| *name == binding.signal) {
                return Err(fail(place, format!("`{}` is the counter of its message", role.signal)));
            }
            if let Some(other) = route.bindings.iter().find(|other| other.signal == binding.signal) {
                return Err(fail(place, format!("`{}` is already `{table}.{}`", role.signal, other.field)));
            }
            route.bindings.push(binding);
        }
        Ok(routes.into_values().collect())
    }

    /// The message and signal a role names, the identifier with the role's node in it, and whether the file has nodes and the
    /// role names none.
    fn find(
        &self,
        place: &str,
        role: &SignalConfig,
    ) -> Result<(&'a Message, &'a Signal, Id, bool), CanError> {
        let fail = |reason: String| fail(place, reason);
        if role.esc.is_some() {
            return Err(fail("`esc` belongs to protocol = \"dronecan\"".to_owned()));
        }
        let (message_name, signal_name) = role
            .signal
            .split_once('.')
            .ok_or_else(|| fail(format!("`{}` is not of the form MESSAGE.signal", role.signal)))?;
        let mut found = None;
        for (database, file) in self.databases.iter().zip(&self.config.database) {
            let Some(message) = database.message(message_name) else { continue };
            if found.is_some() {
                return Err(fail(format!("several DBC files have a message `{message_name}`")));
            }
            found = Some((message, file.node_mask));
        }
        let (message, node_mask) = found.ok_or_else(|| {
            let names =
                self.databases.iter().flat_map(|database| &database.messages).map(|message| &message.name);
            let names = list(names);
            let there =
                if names.is_empty() { "they hold none".to_owned() } else { format!("there are {names}") };
            fail(format!("no DBC file has a message `{message_name}`; {there}"))
        })?;
        let signal = message.signal(signal_name).ok_or_else(|| {
            let names = message.signals.iter().map(|signal| &signal.name);
            fail(format!("message `{message_name}` has no signal `{signal_name}`; it has {}", list(names)))
        })?;
        let id = substitute(message.id, role.node, node_mask).map_err(fail)?;
        Ok((message, signal, id, node_mask.is_some() && role.node.is_none()))
    }

    /// A message with nothing bound yet.
    fn route<F>(
        &self,
        place: &str,
        message: &Message,
        node: Option<u32>,
        id: Id,
    ) -> Result<Route<F>, CanError> {
        let settings = self.config.messages.get(&message.name).cloned().unwrap_or_default();
        if message.length > 8 && !(self.config.fd && needs_fd(message.length)) {
            let reason = if self.config.fd {
                format!("no frame carries the {} bytes of `{}`", message.length, message.name)
            } else {
                format!("`{}` has {} bytes, which needs bus.fd = true", message.name, message.length)
            };
            return Err(fail(place, reason));
        }
        let period_s = settings.period_s.unwrap_or(self.period_s);
        if !(period_s.is_finite() && period_s > 0.0) {
            let reason = format!("{period_s} s is not a period");
            return Err(fail(format!("messages.{}.period_s", message.name), reason));
        }
        let counter = settings.counter.map(|name| find_counter(message, &name)).transpose()?;
        let name =
            node.map_or_else(|| message.name.clone(), |node| format!("{} (node {node})", message.name));
        let (length, bindings) = (message.length, Vec::new());
        Ok(Route {
            name,
            id,
            length,
            least_length: length,
            period_s,
            counter,
            bindings,
            is_one_word: false,
            lacks_node: false,
        })
    }

    /// Every message that `bus.messages` speaks of must be there and in a role: a mistyped name would silently
    /// leave a counter unchecked. The table that a bench file leaves out nobody mistyped: who lists other roles needs no other.
    fn check_messages(&self) -> Result<(), CanError> {
        let roles = self.config.sensors.values().chain(self.config.commands.values());
        let used: Vec<&str> = roles.filter_map(|role| role.signal.split('.').next()).collect();
        let messages = &self.config.messages;
        let is_default = *messages == BusConfig::default().messages;
        let stray = messages.keys().find(|name| !is_default && !used.contains(&name.as_str()));
        stray.map_or(Ok(()), |name| {
            Err(fail(
                format!("messages.{name}"),
                "no role uses this message: take it out, or name one of its signals in bus.sensors"
                    .to_owned(),
            ))
        })
    }
}

/// The safe command must be one that the frames can say: 0 for both rotors, in one frame where they share one.
fn check_commands(commands: &[Route<CommandField>]) -> Result<(), CanError> {
    for route in commands {
        for binding in route.bindings().iter().filter(|binding| binding.field != CommandField::State) {
            let said = binding.zero_as_sent();
            if said.abs() > 1e-9 {
                let reason = format!("`{}` cannot say 0: it would say {said}", binding.signal);
                return Err(fail(format!("commands.{}", binding.field), reason));
            }
        }
        let mut selectors = route.bindings().iter().map(|it| &it.selectors).filter(|it| !it.is_empty());
        let first = selectors.next();
        if selectors.any(|other| Some(other) != first) {
            let reason = format!("`{}` is multiplexed: one frame cannot carry all its commands", route.name);
            return Err(fail("commands", reason));
        }
    }
    Ok(())
}

fn find_counter(message: &Message, name: &str) -> Result<(String, SignalCodec), CanError> {
    let place = || format!("messages.{}.counter", message.name);
    let signal = message
        .signal(name)
        .ok_or_else(|| fail(place(), format!("message `{}` has no signal `{name}`", message.name)))?;
    let plain = signal.codec.factor() == 1.0 && signal.codec.offset() == 0.0 && signal.selector.is_none();
    if signal.codec.layout().number != NumberFormat::Unsigned || !plain {
        return Err(fail(place(), format!("`{name}` must be a plain unsigned integer")));
    }
    Ok((name.to_owned(), signal.codec.clone()))
}

/// The identifier with `node` in its node bits.
fn substitute(id: Id, node: Option<u32>, mask: Option<u32>) -> Result<Id, String> {
    let Some(node) = node else { return Ok(id) };
    let mask = mask.filter(|mask| *mask != 0).ok_or("a node needs the node_mask of its DBC file")?;
    let shift = mask.trailing_zeros();
    if node > mask >> shift {
        return Err(format!("node {node} does not fit the node_mask {mask:#X}"));
    }
    Id::new(id.number() & !mask | node << shift, id.is_extended())
        .ok_or_else(|| format!("the node_mask {mask:#X} does not fit the identifier {id}"))
}

/// Binds a signal to a field that is measured in `si`.
fn bind<F>(
    field: F,
    message: &Message,
    signal: &Signal,
    role: &SignalConfig,
    si: &'static str,
) -> Result<Binding<F>, String> {
    let unit_name = role.unit.as_deref().unwrap_or(&signal.unit);
    let unit = read_unit(unit_name, role.pole_pairs, si)?;
    if !(role.factor.is_finite() && role.factor != 0.0) {
        return Err(format!("factor {} cannot carry a value", role.factor));
    }
    let (scale, offset) = (unit.scale * role.factor, unit.offset * role.factor);
    let in_si = |(one, other): (f64, f64)| {
        let (one, other) = (one * scale + offset, other * scale + offset);
        (one.min(other), one.max(other))
    };
    let written = in_si(signal.range.unwrap_or_else(|| signal.codec.span()));
    let range = (role.minimum.unwrap_or(written.0), role.maximum.unwrap_or(written.1));
    if range.0.is_nan() || range.1.is_nan() || range.0 >= range.1 {
        return Err(format!("no value lies between the minimum {} and the maximum {}", range.0, range.1));
    }
    // A limit that lies on the signal's grid must not be missed by the rounding of f64.
    let slack = 1e-9 * (range.1 - range.0);
    Ok(Binding {
        field,
        signal: signal.name.clone(),
        unit: unit_name.to_owned(),
        codec: signal.codec.clone(),
        scale,
        offset,
        range,
        slack: if slack.is_finite() { slack } else { 0.0 },
        selectors: selectors(message, signal),
    })
}

/// The unit of a signal, `ERPM` included: electrical revolutions need the number of pole pairs, and nothing else
/// takes one.
pub(super) fn read_unit(name: &str, pole_pairs: Option<u32>, si: &'static str) -> Result<Unit, String> {
    let electrical = name.trim().eq_ignore_ascii_case("erpm");
    match (electrical, pole_pairs) {
        (true, Some(pairs)) if pairs > 0 => {
            let unit = Unit::parse("rpm", si).map_err(|error| error.to_string())?;
            Ok(Unit { scale: unit.scale / f64::from(pairs), ..unit })
        }
        (true, _) => Err("ERPM become a rotor's speed only through pole_pairs".to_owned()),
        (false, None) => Unit::parse(name, si).map_err(|error| error.to_string()),
        (false, Some(_)) => Err(format!("pole_pairs belong to the unit ERPM, and this is `{name}`")),
    }
}

fn selectors(message: &Message, signal: &Signal) -> Vec<(SignalCodec, Vec<(u64, u64)>)> {
    let mut above = Vec::new();
    let mut next = signal.selector.as_ref();
    while let Some(selector) = next {
        let Some(multiplexer) = message.signals.get(selector.multiplexer) else { break };
        above.push((multiplexer.codec.clone(), selector.values.clone()));
        next = multiplexer.selector.as_ref();
    }
    above
}

fn list<'a>(names: impl Iterator<Item = &'a String>) -> String {
    const SHOWN: usize = 12;
    let names: Vec<&str> = names.map(String::as_str).collect();
    let shown = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN { format!("{shown} and {} more", names.len() - SHOWN) } else { shown }
}
