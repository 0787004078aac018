//! DroneCAN v0: transfers and their frames, the language in which its messages are defined, and a bench on it.
//!
//! ```text
//! files of DSDL → Library → Place (a number of a message, compiled)
//! Frame → Assembler → Transfer (a whole payload)      payload → Frames
//! [bus] table → DronecanBus → Bridge (a node), Bench (the nodes that an emulator plays)
//! ```
//!
//! DroneCAN specification v1 (dronecan.github.io/Specification); checked bit for bit against its reference implementation in
//! Python (`tools/golden-dronecan`).

mod allocatee;
mod allocation;
mod allocator;
mod asking;
mod assembler;
mod bench;
mod bits;
mod bridge;
mod build;
mod bus;
mod common;
mod config;
pub(super) mod crc;
mod describe;
mod dsdl;
mod join;
mod library;
mod node;
mod node_monitor;
mod parameter;
mod parse;
mod participant;
mod place;
mod received;
mod service;
mod store;
mod transfer;
mod value;
mod watch;

pub use allocatee::Allocatee;
pub use allocation::UniqueId;
pub use allocator::{AllocationEvent, AllocationTable, Keep, NodeIdAllocator};
pub use assembler::{Assembler, Subscription, Transfer};
pub use bus::DronecanBus;
pub use config::{CommandKind, DronecanConfig, DsdlConfig, NodeId};
pub use dsdl::{Array, Cast, Compound, CompoundBody, DsdlField, NumberKind, Primitive, Structure, Type};
pub use join::join;
pub use library::{Definition, Library};
pub use node_monitor::{NodeInfo, NodeMonitor, NodeReport};
pub use parameter::{
    Heard, NodeParameter, ParameterClient, ParameterRequest, ParameterResponse, ParameterValue,
};
pub use participant::Participant;
pub use place::BitPlace;
pub use store::ESC_TIMEOUT_S;
pub use transfer::{
    FRAME_BYTES, Framing, GREATEST_NODE, Tail, TransferFrames, TransferHeader, TransferId, TransferKind,
    priority,
};
pub use value::{Value, ValueError, decode, empty, empty_message, encode};
