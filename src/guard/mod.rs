//! The last gate in front of any actuator, real or emulated.

use serde::{Deserialize, Serialize};

/// The `[guard]` table of the bench file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GuardConfig {}
