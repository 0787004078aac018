//! The plant that stands in for the hardware, behind shared memory or CAN.

use serde::{Deserialize, Serialize};

/// The `[emulator]` table of the bench file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EmulatorConfig {}
