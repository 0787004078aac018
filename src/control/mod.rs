//! Controllers: EMC and PID, their design, and allocation to two rotors.

use serde::{Deserialize, Serialize};

/// The `[controller]` table of the bench file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {}
