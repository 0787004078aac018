//! A bench on DroneCAN as built: the messages that its roles need, with every name looked up once.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::sync::Arc;

use crate::can::config::{BusConfig, SignalConfig};
use crate::can::error::CanError;
use crate::can::frame::Id;
use crate::can::load::{BusLoad, MessageLoad, classic_bits};
use crate::can::resolve::{check_interface, fail, read_unit};
use crate::can::thresholds::THRESHOLDS;
use crate::signal::{Channel, ROTORS};

use super::assembler::Subscription;
use super::common::{Common, name};
use super::config::{CommandKind, DronecanConfig, DsdlConfig};
use super::dsdl::{Compound, Structure};
use super::library::{Definition, Library};
use super::place::Place;
use super::transfer::{FRAME_BYTES, Frames, GREATEST_NODE, Kinship};

/// Index of the last ESC that a command reaches.
const LAST_ESC: u8 = 19;
/// Greatest size of a file of DSDL [byte].
const LARGEST_FILE: u64 = 1 << 20;

/// A number of a message that feeds a channel.
#[derive(Debug, Clone)]
pub(super) struct Bound {
    pub channel: Channel,
    /// Path of the field.
    pub path: String,
    pub unit: String,
    pub place: Place,
    /// SI value = number * `scale` + `offset`.
    pub scale: f64,
    pub offset: f64,
    /// Least and greatest allowed value in SI.
    pub range: (f64, f64),
    /// The node that is believed; `None` = the first that says it.
    pub node: Option<u8>,
    /// The ESC index that the message must have, and where it stands.
    pub esc: Option<(Place, u8)>,
}

/// A type that is received, with all that is read from it.
#[derive(Debug, Clone)]
pub(super) struct Received {
    pub compound: Arc<Compound>,
    pub type_id: u16,
    /// [s] period at which each sender sends it.
    pub period_s: f64,
    pub bound: Vec<Bound>,
}

impl Received {
    pub fn subscription(&self) -> Subscription {
        Subscription::new(self.type_id, Kinship::Message, self.compound.signature, self.message().most_bits())
    }

    pub fn message(&self) -> &Structure {
        const NONE: &Structure = &Structure { fields: Vec::new(), is_union: false };
        self.compound.message().unwrap_or(NONE)
    }
}

/// The command as it is sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Commanding {
    /// Name of the type, its field, and the unit of that.
    pub name: &'static str,
    pub field: &'static str,
    pub unit: &'static str,
    /// Number that a command of 1 becomes.
    pub full: f64,
    /// The number of each rotor in the message.
    pub rotors: [Place; ROTORS],
    /// [byte] of the message.
    pub length: usize,
    pub type_id: u16,
    pub subscription: Subscription,
}

/// The `[bus]` table of a bench on DroneCAN, resolved.
#[derive(Debug, Clone)]
pub struct DronecanBus {
    pub(super) node_id: u8,
    pub(super) esc_index: [u8; ROTORS],
    /// What is sent, and, of the same kind or the other, what nobody else may send.
    pub(super) command: Commanding,
    pub(super) other_command: Commanding,
    pub(super) received: Vec<Received>,
    pub(super) common: Common,
    /// [s] control period.
    pub(super) period_s: f64,
}

impl DronecanBus {
    /// Reads the files of DSDL and finds every number that the roles name.
    ///
    /// # Errors
    /// [`CanError::Read`] and [`CanError::Database`] for a file, [`CanError::Role`] for a role that cannot be filled, and
    /// [`CanError::Overload`] when the frames cannot all be on the bus.
    pub fn build(config: &BusConfig, period_s: f64) -> Result<Self, CanError> {
        check_interface(config)?;
        let own = &config.dronecan;
        check_table(config)?;
        let definitions = own.dsdl.iter().map(read_definition).collect::<Result<Vec<_>, _>>()?;
        let library = Library::build(&definitions)?;
        let raw = commanding(&library, CommandKind::Raw, own)?;
        let rpm = commanding(&library, CommandKind::Rpm, own)?;
        let (command, other_command) = if own.command == CommandKind::Raw { (raw, rpm) } else { (rpm, raw) };
        let received = receive(config, &library, period_s)?;
        let bus = Self {
            node_id: own.node_id,
            esc_index: own.esc_index,
            command,
            other_command,
            received,
            common: Common::build(&library)?,
            period_s,
        };
        let percent = bus.load_of(config).percent;
        if percent > THRESHOLDS.maximum_percent {
            return Err(CanError::Overload { percent, limit: THRESHOLDS.maximum_percent });
        }
        Ok(bus)
    }

    /// How full the messages make the bus at worst; what each node says of itself once a second is left out.
    pub(super) fn load_of(&self, config: &BusConfig) -> BusLoad {
        let bit_rate = f64::from(config.bit_rate.max(1));
        let messages: Vec<MessageLoad> = self
            .descriptions()
            .into_iter()
            .map(|message| {
                let bits = transfer_bits(message.bytes) as f64;
                let percent = 100.0 * bits / (bit_rate * message.period_s);
                MessageLoad { message: message.name, bits, percent }
            })
            .collect();
        let percent = messages.iter().map(|message| message.percent).sum();
        BusLoad { messages, percent }
    }
}

/// [bit] of a transfer of so many bytes, all its frames at full stuffing.
fn transfer_bits(bytes: usize) -> usize {
    let frames = Frames::count(bytes);
    let total = if frames > 1 { bytes + 2 } else { bytes };
    let id = Id::Extended(0);
    (frames - 1) * classic_bits(id, FRAME_BYTES + 1)
        + classic_bits(id, total - (frames - 1) * FRAME_BYTES + 1)
}

fn check_table(config: &BusConfig) -> Result<(), CanError> {
    let own = &config.dronecan;
    let default = BusConfig::default();
    if config.fd {
        return Err(fail("fd", "DroneCAN is spoken in classical frames here".to_owned()));
    }
    if config.database != default.database {
        return Err(fail("database", "DBC files say nothing of DroneCAN: see bus.dronecan.dsdl".to_owned()));
    }
    if config.commands != default.commands {
        return Err(fail("commands", "the commands of DroneCAN are said in bus.dronecan".to_owned()));
    }
    if !(1..=GREATEST_NODE).contains(&own.node_id) {
        let reason = format!("{} is no node id of 1 to {GREATEST_NODE}", own.node_id);
        return Err(fail("dronecan.node_id", reason));
    }
    if own.esc_index[0] == own.esc_index[1] || own.esc_index.iter().any(|index| *index > LAST_ESC) {
        let reason = format!("two different indices of 0 to {LAST_ESC} are needed");
        return Err(fail("dronecan.esc_index", reason));
    }
    if !(1..=8191).contains(&own.raw_maximum) {
        return Err(fail("dronecan.raw_maximum", format!("{} is not in 1..8191", own.raw_maximum)));
    }
    match (own.command, own.rpm_maximum) {
        (CommandKind::Rpm, None) => {
            let reason = "a command in rpm needs the speed that a command of 1 stands for".to_owned();
            Err(fail("dronecan.rpm_maximum", reason))
        }
        (_, Some(rpm)) if !(1..=131_071).contains(&rpm) => {
            Err(fail("dronecan.rpm_maximum", format!("{rpm} is not in 1..131071")))
        }
        _ => Ok(()),
    }
}

impl DsdlConfig {
    /// The text of the file: what somebody needs to understand recorded frames later.
    ///
    /// # Errors
    /// [`CanError::Read`]; what lies beyond a megabyte is not read.
    pub fn text(&self) -> Result<String, CanError> {
        let read = || {
            let mut text = String::new();
            File::open(&self.file)?.take(LARGEST_FILE).read_to_string(&mut text)?;
            Ok(text)
        };
        read().map_err(|source| CanError::Read { file: self.file.clone(), source })
    }
}

fn read_definition(config: &DsdlConfig) -> Result<Definition, CanError> {
    Definition::new(&config.file, &config.namespace, config.text()?)
}

/// A command message, long enough for both rotors.
fn commanding(library: &Library, kind: CommandKind, own: &DronecanConfig) -> Result<Commanding, CanError> {
    let (type_name, field, unit, full) = match kind {
        CommandKind::Raw => (name::RAW_COMMAND, "cmd", "", f64::from(own.raw_maximum)),
        CommandKind::Rpm => (name::RPM_COMMAND, "rpm", "rpm", f64::from(own.rpm_maximum.unwrap_or(1))),
    };
    let missing = || fail("dronecan", format!("no type `{type_name}`"));
    let compound = library.get(type_name).ok_or_else(missing)?;
    let (message, type_id) = compound.message().zip(compound.id).ok_or_else(missing)?;
    let place = |index: u8| {
        Place::find(message, &format!("{field}[{index}]"))
            .map_err(|reason| fail("dronecan.esc_index", reason))
    };
    let rotors = [place(own.esc_index[0])?, place(own.esc_index[1])?];
    let length = rotors.iter().map(Place::end).max().unwrap_or(0).div_ceil(8);
    let subscription = Subscription::new(type_id, Kinship::Message, compound.signature, message.most_bits());
    Ok(Commanding { name: type_name, field, unit, full, rotors, length, type_id, subscription })
}

/// What a bench on DroneCAN reads when its file lists no sensors: an IMU that turns about its z axis, and two ESCs.
fn default_sensors() -> BTreeMap<Channel, SignalConfig> {
    let imu = |field: &str| format!("uavcan.equipment.ahrs.RawIMU.{field}");
    let esc = |field: &str| format!("uavcan.equipment.esc.Status.{field}");
    let roles = [
        (Channel::BodyRate, imu("rate_gyro_latest[2]")),
        (Channel::AccelerationX, imu("accelerometer_latest[0]")),
        (Channel::AccelerationY, imu("accelerometer_latest[1]")),
        (Channel::AccelerationZ, imu("accelerometer_latest[2]")),
        (Channel::BatteryVoltage, esc("voltage")),
        (Channel::PropellerRate1, esc("rpm")),
        (Channel::PropellerRate2, esc("rpm")),
        (Channel::Current1, esc("current")),
        (Channel::Current2, esc("current")),
        (Channel::EscTemperature1, esc("temperature")),
        (Channel::EscTemperature2, esc("temperature")),
    ];
    roles.into_iter().map(|(channel, signal)| (channel, SignalConfig::new(&signal))).collect()
}

/// Unit of a field of the published types, which DSDL itself does not say.
fn published_unit(type_name: &str, path: &str) -> Option<&'static str> {
    if !type_name.starts_with("uavcan.equipment.") {
        return None;
    }
    match path.split('[').next()? {
        "rpm" => Some("rpm"),
        "voltage" => Some("V"),
        "current" => Some("A"),
        "temperature" => Some("K"),
        "motor_temperature_degC" => Some("degC"),
        "rate_gyro_latest" => Some("rad/s"),
        "accelerometer_latest" => Some("m/s^2"),
        _ => None,
    }
}

/// The types that the roles need.
fn receive(config: &BusConfig, library: &Library, period_s: f64) -> Result<Vec<Received>, CanError> {
    let is_default = config.sensors == BusConfig::default().sensors;
    let sensors = if is_default { default_sensors() } else { config.sensors.clone() };
    let mut received: BTreeMap<String, Received> = BTreeMap::new();
    for (channel, role) in &sensors {
        let place = format!("sensors.{channel}");
        let refuse = |reason: String| fail(place.clone(), format!("`{}`: {reason}", role.signal));
        let (compound, path) = find_type(library, &role.signal)
            .ok_or_else(|| refuse("no type of DSDL has this name; see bus.dronecan.dsdl".to_owned()))?;
        let type_id =
            compound.id.ok_or_else(|| refuse("the type has no id: nobody sends it alone".to_owned()))?;
        let bound = bind(*channel, compound, path, role, config).map_err(refuse)?;
        let settings = config.messages.get(&compound.name);
        if settings.is_some_and(|it| it.counter.is_some()) {
            let reason = "a transfer has its own number: no counter is needed".to_owned();
            return Err(fail(format!("messages.{}.counter", compound.name), reason));
        }
        let period_s = settings.and_then(|it| it.period_s).unwrap_or(period_s);
        if !(period_s.is_finite() && period_s > 0.0) {
            let reason = format!("{period_s} s is not a period");
            return Err(fail(format!("messages.{}.period_s", compound.name), reason));
        }
        let entry = received.entry(compound.name.clone());
        let new = || Received { compound: Arc::clone(compound), type_id, period_s, bound: Vec::new() };
        entry.or_insert_with(new).bound.push(bound);
    }
    let default = BusConfig::default().messages;
    let mut said = config.messages.iter().filter(|(name, said)| default.get(*name) != Some(*said));
    if let Some((name, _)) = said.find(|(name, _)| !received.contains_key(*name)) {
        return Err(fail(format!("messages.{name}"), "no role uses this message".to_owned()));
    }
    Ok(received.into_values().collect())
}

/// The type that a signal's name begins with, and the path that follows.
fn find_type<'a, 'b>(library: &'a Library, signal: &'b str) -> Option<(&'a Arc<Compound>, &'b str)> {
    let mut ends = signal.match_indices('.').map(|(at, _)| at);
    ends.find_map(|at| Some((library.get(signal.get(..at)?)?, signal.get(at + 1..)?)))
}

/// Binds a number of a message to a channel.
fn bind(
    channel: Channel,
    compound: &Compound,
    path: &str,
    role: &SignalConfig,
    config: &BusConfig,
) -> Result<Bound, String> {
    let message = compound.message().ok_or("this is a service, and no message")?;
    let place = Place::find(message, path)?;
    let named = role.unit.as_deref().or_else(|| published_unit(&compound.name, path));
    let unit_name = named.ok_or("DSDL says no unit: give the role one, as `unit = \"rpm\"`")?;
    let unit = read_unit(unit_name, role.pole_pairs, channel.unit())?;
    if !(role.factor.is_finite() && role.factor != 0.0) {
        return Err(format!("factor {} cannot carry a value", role.factor));
    }
    let (scale, offset) = (unit.scale * role.factor, unit.offset * role.factor);
    let (low, high) = place.span();
    let (one, other) = (low * scale + offset, high * scale + offset);
    let range = (role.minimum.unwrap_or(one.min(other)), role.maximum.unwrap_or(one.max(other)));
    if range.0.is_nan() || range.1.is_nan() || range.0 >= range.1 {
        return Err(format!("no value lies between the minimum {} and the maximum {}", range.0, range.1));
    }
    let node = role.node.map(|node| {
        let node = u8::try_from(node).ok().filter(|node| (1..=GREATEST_NODE).contains(node));
        match node.ok_or(format!("a node id is 1 to {GREATEST_NODE}"))? {
            node if node == config.dronecan.node_id => Err(format!("{node} is the bridge's own node id")),
            node => Ok(node),
        }
    });
    // Who says which node it is of a type without an index needs no index.
    let index = Place::find(message, "esc_index").ok();
    let rotor = usize::from(channel.name().ends_with("_2"));
    let default = config.dronecan.esc_index.get(rotor).copied().map(u32::from);
    let esc = match (role.esc.or(default), index) {
        (Some(esc), Some(place)) if f64::from(esc) <= place.span().1 => Some((place, esc as u8)),
        (Some(esc), Some(_)) => return Err(format!("no ESC has the index {esc}")),
        (_, None) if role.esc.is_some() => return Err("this message has no field `esc_index`".to_owned()),
        _ => None,
    };
    let (path, unit) = (path.to_owned(), unit_name.to_owned());
    Ok(Bound { channel, path, unit, place, scale, offset, range, node: node.transpose()?, esc })
}
