//! Frames, DBC files, the compiled codec, signal roles, the SocketCAN port, candump logs.

use serde::{Deserialize, Serialize};

/// The `[bus]` table of the bench file: interface, DBC files, roles of signals.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BusConfig {}
