//! What all nodes have in common: how they say how they are, whether the rotors may turn, and what they are.

use crate::can::error::CanError;
use crate::can::resolve::fail;

use super::allocation::{self, UniqueId};
use super::assembler::Subscription;
use super::dsdl::{CompoundBody, Structure};
use super::library::Library;
use super::place::BitPlace;
use super::service::{self, Service};
use super::transfer::{Framing, TransferKind};
use super::value::{Value, empty_message, encode};

/// The types that every bench speaks of.
pub(super) mod name {
    pub const RAW_COMMAND: &str = "uavcan.equipment.esc.RawCommand";
    pub const RPM_COMMAND: &str = "uavcan.equipment.esc.RPMCommand";
    pub const ARMING_STATUS: &str = "uavcan.equipment.safety.ArmingStatus";
    pub const NODE_STATUS: &str = "uavcan.protocol.NodeStatus";
    pub const NODE_INFO: &str = "uavcan.protocol.GetNodeInfo";
}

/// What every node says of itself, and what it is asked.
#[derive(Debug, Clone)]
pub(super) struct Common {
    pub arming: Subscription,
    pub status: Subscription,
    /// Fields of `NodeStatus`: seconds since the start, health, mode, and a code of our own.
    pub uptime: BitPlace,
    pub health: BitPlace,
    pub mode: BitPlace,
    pub code: BitPlace,
    /// Data type id and signature of `GetNodeInfo`, its response, which ends with the node's name, and places in that.
    pub info_id: u16,
    pub info_signature: u64,
    info: Structure,
    version: [BitPlace; 2],
    /// [byte] where the sixteen bytes of a node's unique id begin.
    unique_id: usize,
    /// What nodes without an id ask for one with.
    pub allocation: Subscription,
    /// Parameters of a node, and what it does with them.
    pub get_set: Service,
    pub execute_opcode: Service,
}

impl Common {
    pub fn build(library: &Library) -> Result<Self, CanError> {
        let missing = |name: &str| fail("dronecan", format!("no type `{name}`"));
        let message = |name: &'static str| {
            let compound = library.get(name).ok_or_else(|| missing(name))?;
            let (message, id) = compound.message().zip(compound.id).ok_or_else(|| missing(name))?;
            Ok((
                message,
                Subscription::new(id, TransferKind::Message, compound.signature, message.most_bits()),
            ))
        };
        let (_, arming) = message(name::ARMING_STATUS)?;
        let (node_status, status) = message(name::NODE_STATUS)?;
        let field = |path| BitPlace::find(node_status, path).map_err(|reason| fail("dronecan", reason));
        let info = library.get(name::NODE_INFO).ok_or_else(|| missing(name::NODE_INFO))?;
        let (CompoundBody::Service(_, response), Some(info_id)) = (&info.body, info.id) else {
            return Err(missing(name::NODE_INFO));
        };
        let place = |path| BitPlace::find(response, path).map_err(|reason| fail("dronecan", reason));
        Ok(Self {
            arming,
            status,
            uptime: field("uptime_sec")?,
            health: field("health")?,
            mode: field("mode")?,
            code: field("vendor_specific_status_code")?,
            info_id,
            info_signature: info.signature,
            unique_id: place("hardware_version.unique_id[0]")?.at / 8,
            version: [place("software_version.major")?, place("software_version.minor")?],
            info: response.clone(),
            allocation: allocation::subscription(library)?,
            get_set: Service::find(library, service::name::GET_SET)?,
            execute_opcode: Service::find(library, service::name::EXECUTE_OPCODE)?,
        })
    }

    /// What a node answers who asks it what it is, in such frames; its state, at the beginning, is left to it.
    pub fn node_info(&self, name: &str, unique_id: UniqueId, framing: Framing) -> Vec<u8> {
        let mut info = empty_message(&self.info, 0.0);
        if let Value::List(fields) = &mut info
            && let Some(last) = fields.last_mut()
        {
            *last = Value::List(name.bytes().map(|byte| Value::Integer(i128::from(byte))).collect());
        }
        // A name that is too long, or none of this type, cannot be: both are written here.
        let mut bytes = encode(&self.info, &info, framing).unwrap_or_default();
        let [major, minor] = self.version;
        major.write(&mut bytes, framing, number(env!("CARGO_PKG_VERSION_MAJOR")));
        minor.write(&mut bytes, framing, number(env!("CARGO_PKG_VERSION_MINOR")));
        let place = bytes.iter_mut().skip(self.unique_id);
        place.zip(unique_id.0).for_each(|(place, byte)| *place = byte);
        bytes
    }

    /// Listens to who asks `node` what it is.
    pub fn info_request(&self, node: u8) -> Subscription {
        Subscription::new(self.info_id, TransferKind::Request { to: node }, self.info_signature, 0)
    }
}

fn number(digits: &str) -> f64 {
    digits.parse().unwrap_or(0.0)
}
