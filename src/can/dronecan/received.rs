//! What is read of a bench on DroneCAN: the types that its roles need, and each number of them bound to a channel.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::can::config::{BusConfig, SignalConfig};
use crate::can::error::CanError;
use crate::can::resolve::{fail, read_unit};
use crate::can::route::FrameRefusal;
use crate::signal::Channel;

use super::assembler::{Subscription, Transfer};
use super::dsdl::{Compound, Structure};
use super::library::Library;
use super::place::BitPlace;
use super::transfer::{Framing, GREATEST_NODE, TransferKind};
use super::value::{empty_message, encode};

/// A number of a message that feeds a channel.
#[derive(Debug, Clone)]
pub(super) struct Bound {
    pub channel: Channel,
    /// Path of the field.
    pub path: String,
    pub unit: String,
    pub place: BitPlace,
    /// SI value = number * `scale` + `offset`.
    pub scale: f64,
    pub offset: f64,
    /// Least and greatest allowed value in SI.
    pub range: (f64, f64),
    /// The node that is believed; `None` = the first that says it.
    pub node: Option<u8>,
    /// The ESC index that the message must have, and where it stands.
    pub esc: Option<(BitPlace, u8)>,
}

impl Bound {
    /// Whether the transfer is of the node and the ESC that the role means.
    #[inline]
    pub(super) fn is_meant(&self, transfer: &Transfer<'_>) -> bool {
        let is_node = self.node.is_none_or(|node| node == transfer.header.source);
        is_node
            && self.esc.is_none_or(|(place, index)| {
                place.read(transfer.payload, transfer.framing) == Some(f64::from(index))
            })
    }

    /// The value in SI, or why not.
    #[inline]
    pub(super) fn read(&self, transfer: &Transfer<'_>) -> Result<f64, FrameRefusal> {
        let number = self.place.read(transfer.payload, transfer.framing).ok_or(FrameRefusal::WrongLength)?;
        let value = number * self.scale + self.offset;
        // A limit that lies on the number's grid must not be missed by the rounding of f64.
        let slack = 1e-9 * (self.range.1 - self.range.0);
        if !value.is_finite() {
            Err(FrameRefusal::NotANumber)
        } else if value < self.range.0 - slack || value > self.range.1 + slack {
            Err(FrameRefusal::OutOfRange)
        } else {
            Ok(value)
        }
    }
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

/// Who sends a message: its node, as far as one is named, and the ESC whose it is.
pub(super) type Sender = (Option<u8>, Option<u8>);

impl Received {
    pub fn subscription(&self) -> Subscription {
        Subscription::new(
            self.type_id,
            TransferKind::Message,
            self.compound.signature,
            self.message().most_bits(),
        )
    }

    pub fn message(&self) -> &Structure {
        const NONE: &Structure = &Structure { fields: Vec::new(), is_union: false };
        self.compound.message().unwrap_or(NONE)
    }

    /// A message of which nothing is set, for such frames; a float that is unknown says so.
    pub fn empty_payload(&self, framing: Framing) -> Vec<u8> {
        encode(self.message(), &empty_message(self.message(), f64::NAN), framing).unwrap_or_default()
    }

    /// The senders of this type, each with the numbers that are read of its messages.
    pub fn senders(&self) -> Vec<(Sender, Vec<&Bound>)> {
        let mut senders: Vec<(Sender, Vec<&Bound>)> = Vec::new();
        for bound in &self.bound {
            let sender = (bound.node, bound.esc.map(|(_, index)| index));
            match senders.iter_mut().find(|(known, _)| *known == sender) {
                Some((_, bounds)) => bounds.push(bound),
                None => senders.push((sender, vec![bound])),
            }
        }
        senders
    }
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
pub(super) fn receive(
    config: &BusConfig,
    library: &Library,
    period_s: f64,
) -> Result<Vec<Received>, CanError> {
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
        return Err(fail(
            format!("messages.{name}"),
            "no role uses this message: take it out, or name one of its signals in bus.sensors".to_owned(),
        ));
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
    let place = BitPlace::find(message, path)?;
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
            node if Some(node) == config.dronecan.node_id.number() => {
                Err(format!("{node} is the bridge's own node id"))
            }
            node => Ok(node),
        }
    });
    // Who says which node it is of a type without an index needs no index.
    let index = BitPlace::find(message, "esc_index").ok();
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
