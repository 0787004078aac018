//! Frames, DBC files, the compiled codec, signal roles, the SocketCAN port, candump logs.
//!
//! ```text
//! DBC file → Database ┐
//! [bus] table ────────┴→ Roles:  Frame → Sensors (bridge)      Applied → frames (bridge)
//!                                frames ← Sensors (emulator)   RotorCommands ← Frame (emulator)
//! Port: frames with stamps from and to a SocketCAN interface
//! ```

mod codec;
mod config;
mod counter;
mod database;
mod error;
mod error_frame;
mod field;
mod frame;
mod interface;
mod load;
mod port;
mod resolve;
mod roles;
mod route;
mod socket;
mod source;
mod stamp;
mod timestamps;
pub mod walk;

pub use codec::{ByteOrder, Layout, LayoutError, Number, SignalCodec};
pub use config::{BusConfig, DatabaseConfig, MessageConfig, SignalConfig};
pub use database::{Database, Message, Selector, Signal};
pub use error::CanError;
pub use error_frame::ErrorFrame;
pub use field::{CommandField, SensorField};
pub use frame::{Frame, Id, Kind, MAXIMUM_LENGTH, Payload, is_fd_length};
pub use interface::{InterfaceAnswer, InterfaceStatus};
pub use load::{BusLoad, MAXIMUM_PERCENT, MessageLoad, WARNING_PERCENT, classic_bits, fd_bits, worst_case};
pub use port::{Arrival, Bus, Fault, Port, PortCounts, kernel_has_can};
pub use roles::{CommandFrames, Counts, Decoded, ReceiverState, Roles, RotorCommands, SenderState};
pub use route::{Binding, Refusal, Route};
pub use timestamps::{Timestamps, timestamps};
