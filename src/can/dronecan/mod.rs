//! DroneCAN v0: transfers and their frames, and the language in which its messages are defined.
//!
//! ```text
//! files of DSDL → Library → Place (a number of a message, compiled)
//! Frame → Assembler → Transfer (a whole payload)      payload → Frames
//! ```
//!
//! DroneCAN specification v1 (dronecan.github.io/Specification); checked bit for bit against its reference implementation in
//! Python (`tools/golden-dronecan`).

mod assembler;
mod bits;
mod crc;
mod dsdl;
mod library;
mod parse;
mod place;
mod transfer;
mod value;

pub use assembler::{Assembler, Subscription, Transfer};
pub use dsdl::{Array, Body, Cast, Compound, Field, Kind, Primitive, Structure, Type};
pub use library::{Definition, Library};
pub use place::Place;
pub use transfer::{FRAME_BYTES, Frames, GREATEST_NODE, Header, Kinship, Tail, TransferId, priority};
pub use value::{Value, ValueError, decode, empty, empty_message, encode};
