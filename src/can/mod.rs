//! The bus: frames, DBC files, the compiled codec, signal roles, protocols, the SocketCAN port and its echoes, UDP multicast, the bus's load.
//!
//! ```text
//! DBC file → Database ┐
//! [bus] table ────────┴→ Roles:  Frame → Sensors (bridge)      Applied → frames (bridge)
//!                                frames ← Sensors (emulator)   RotorCommands ← Frame (emulator)
//! protocol(): both ends of a bus, whatever it speaks (Roles, or DroneCAN)
//! BusPort: frames with stamps from and to a SocketCAN interface (Port), or UDP multicast where there is no CAN (Multicast)
//! ```

mod bus;
mod bus_port;
mod codec;
mod config;
mod counter;
mod database;
mod dbc;
pub mod dronecan;
mod echo;
mod error;
mod error_frame;
mod field;
mod frame;
mod interface;
mod layout;
mod load;
mod multicast;
mod port;
mod protocol;
mod resolve;
mod roles;
mod route;
mod select;
mod socket;
mod source;
mod stamp;
pub mod thresholds;
mod timestamps;
pub mod walk;

pub use bus::{Arrival, Bus, BusFault, PortCounts};
pub use bus_port::{BusPort, check_there, is_virtual};
pub use codec::SignalCodec;
pub use config::{BusConfig, DatabaseConfig, MessageConfig, ProtocolName, SignalConfig};
pub use database::{Database, Message, Selector, Signal};
pub use error::CanError;
pub use error_frame::ErrorFrame;
pub use field::CommandField;
pub use frame::{Frame, FrameKind, Id, MAXIMUM_LENGTH, Payload, is_fd_length};
pub use interface::{InterfaceAnswer, InterfaceStatus};
pub use layout::{ByteOrder, LayoutError, NumberFormat, SignalLayout};
pub use load::{BusLoad, MessageLoad, classic_bits, fd_bits, worst_case};
pub use multicast::{MulticastGroup, MulticastPort, NetworkDevice};
pub use port::{Port, kernel_has_can};
pub use protocol::{
    BenchEnd, BridgeEnd, ForeignSender, IdFilter, MessageDescription, NodeTrouble, Protocol,
    SignalDescription,
};
pub use roles::{CommandFrames, Counts, Decoded, ReceiverState, Roles, RotorCommands, SenderState};
pub use route::{Binding, FrameRefusal, Route};
pub use select::{join, protocol};
pub use timestamps::{Timestamps, timestamps};
