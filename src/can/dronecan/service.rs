//! A service: what a node is asked for, and how it answers.

use crate::can::error::CanError;
use crate::can::resolve::fail;

use super::assembler::Subscription;
use super::crc;
use super::dsdl::{CompoundBody, Structure};
use super::library::Library;
use super::transfer::{TransferHeader, TransferKind, priority};

/// Services that nodes are asked for.
pub(super) mod name {
    pub const GET_SET: &str = "uavcan.protocol.param.GetSet";
    pub const EXECUTE_OPCODE: &str = "uavcan.protocol.param.ExecuteOpcode";
}

/// A service, found in a library.
#[derive(Debug, Clone)]
pub(super) struct Service {
    pub type_id: u16,
    signature: u64,
    pub request: Structure,
    pub response: Structure,
}

impl Service {
    pub fn find(library: &Library, name: &str) -> Result<Self, CanError> {
        let missing = || fail("dronecan", format!("no type `{name}`"));
        let compound = library.get(name).ok_or_else(missing)?;
        let (CompoundBody::Service(request, response), Some(type_id)) = (&compound.body, compound.id) else {
            return Err(missing());
        };
        let (request, response) = (request.clone(), response.clone());
        Ok(Self { type_id, signature: compound.signature, request, response })
    }

    /// Of requests and responses: what their checksums begin with.
    pub fn seed(&self) -> u16 {
        crc::transfer_seed(self.signature)
    }

    /// Listens to who asks `node`.
    pub fn requests_to(&self, node: u8) -> Subscription {
        let kind = TransferKind::Request { to: node };
        Subscription::new(self.type_id, kind, self.signature, self.request.most_bits())
    }

    /// Listens to what `node` is answered.
    pub fn responses_to(&self, node: u8) -> Subscription {
        let kind = TransferKind::Response { to: node };
        Subscription::new(self.type_id, kind, self.signature, self.response.most_bits())
    }

    /// The header of a request.
    pub fn request(&self, source: u8, to: u8) -> TransferHeader {
        self.header(source, TransferKind::Request { to })
    }

    /// The header of a response.
    pub fn response(&self, source: u8, to: u8) -> TransferHeader {
        self.header(source, TransferKind::Response { to })
    }

    fn header(&self, source: u8, kind: TransferKind) -> TransferHeader {
        TransferHeader { priority: priority::LOW, type_id: self.type_id, source, kind, discriminator: 0 }
    }
}
